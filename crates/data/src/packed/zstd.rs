//! Chunks packed by Zstandard, which zarr-python writes unless it is told otherwise. They are read, not written.

use std::borrow::Cow;
use std::io::Read as _;
use std::sync::Arc;

use ruzstd::decoding::StreamingDecoder;
use zarrs::array::codec::{
    BytesToBytesCodecTraits, Codec, CodecError, CodecMetadataOptions, CodecOptions, CodecPlugin, CodecTraits,
    PartialDecoderCapability, PartialEncoderCapability,
};
use zarrs::array::{BytesRepresentation, RawBytes, RecommendedConcurrency};
use zarrs::metadata::Configuration;
use zarrs::metadata::v3::MetadataV3;
use zarrs::plugin::PluginCreateError;
use zarrs::registry::codec::ZSTD;

inventory::submit! {
    CodecPlugin::new(ZSTD, |identifier| identifier == ZSTD, create)
}

fn create(metadata: &MetadataV3) -> Result<Codec, PluginCreateError> {
    Ok(Codec::BytesToBytes(Arc::new(Zstd { configuration: metadata.configuration().cloned() })))
}

/// Unpacks Zstandard.
#[derive(Debug, Clone)]
struct Zstd {
    configuration: Option<Configuration>,
}

impl CodecTraits for Zstd {
    fn identifier(&self) -> &'static str {
        ZSTD
    }

    fn configuration_opt(&self, _name: &str, _options: &CodecMetadataOptions) -> Option<Configuration> {
        self.configuration.clone()
    }

    fn partial_decoder_capability(&self) -> PartialDecoderCapability {
        PartialDecoderCapability { partial_read: false, partial_decode: false }
    }

    fn partial_encoder_capability(&self) -> PartialEncoderCapability {
        PartialEncoderCapability { partial_encode: false }
    }
}

impl BytesToBytesCodecTraits for Zstd {
    fn into_dyn(self: Arc<Self>) -> Arc<dyn BytesToBytesCodecTraits> {
        self
    }

    fn recommended_concurrency(
        &self,
        _decoded_representation: &BytesRepresentation,
    ) -> Result<RecommendedConcurrency, CodecError> {
        Ok(RecommendedConcurrency::new_maximum(1))
    }

    fn encode<'a>(
        &self,
        _decoded_value: RawBytes<'a>,
        _options: &CodecOptions,
    ) -> Result<RawBytes<'a>, CodecError> {
        Err(CodecError::Other("Zstandard is read and not written".to_owned()))
    }

    fn decode<'a>(
        &self,
        encoded_value: RawBytes<'a>,
        decoded_representation: &BytesRepresentation,
        _options: &CodecOptions,
    ) -> Result<RawBytes<'a>, CodecError> {
        let fault = |error: &dyn ToString| CodecError::Other(format!("Zstandard: {}", error.to_string()));
        let decoder = StreamingDecoder::new(&*encoded_value).map_err(|error| fault(&error))?;
        // A damaged chunk must not fill the memory: one byte more than expected is enough to refuse it.
        let most = decoded_representation.size().map_or(u64::MAX, |size| size + 1);
        let mut bytes = Vec::new();
        decoder.take(most).read_to_end(&mut bytes).map_err(|error| fault(&error))?;
        Ok(Cow::Owned(bytes))
    }

    fn encoded_representation(&self, _decoded_representation: &BytesRepresentation) -> BytesRepresentation {
        BytesRepresentation::UnboundedSize
    }
}
