//! Random numbers, of which each purpose has its own.

use rand::SeedableRng as _;
use rand_chacha::ChaCha8Rng;

/// What random numbers are for.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Purpose {
    Relief = 1,
    Steps,
    Wobble,
    Offset,
    Light,
    Noise,
    Texture,
}

/// Random numbers for one purpose; `part` numbers its parts.
pub(crate) fn random(seed: u64, purpose: Purpose, part: u64) -> ChaCha8Rng {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    random.set_stream(((purpose as u64) << 40) + part);
    random
}
