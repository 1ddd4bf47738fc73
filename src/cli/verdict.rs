//! Limits of a surface on the command line, and what follows from the verdict.

use clap::Args;

use super::rig::{KeyGroup, KeyOption, KeyOptions};
use super::{CliError, Talk};
use crate::profile::{Override, Profile};
use crate::results::SurfaceSummary;
use epirig_core::fault::Blame;
use epirig_data::sequence::Sequence;
use epirig_surface::conformity::{Rule, Specification, Verdict};

/// The options of [`VerdictArguments`] that are keys of a profile.
#[derive(Debug)]
pub(super) struct VerdictKeys;

impl KeyGroup for VerdictKeys {
    const HEADING: &'static str = "Verdict";

    fn options() -> Vec<KeyOption> {
        KeyOption::all(&["target.tolerance", "target.decision_rule", "target.risk_percent"])
    }
}

/// Limits of a surface, and the rule by which it is decided.
#[derive(Debug, Args)]
pub(super) struct VerdictArguments {
    #[command(flatten)]
    keys: KeyOptions<VerdictKeys>,
    /// Exit with 0 whatever the verdict is: without it, 9 is fail and 10 undecided
    #[arg(long, help_heading = VerdictKeys::HEADING)]
    no_verdict: bool,
}

impl VerdictArguments {
    /// As keys of a profile.
    pub(super) fn changes(&self) -> Vec<Override> {
        self.keys.changes()
    }

    /// Refuses what cannot be read, before any work.
    pub(super) fn check(&self) -> Result<(), CliError> {
        Profile::of(&self.changes())?;
        Ok(())
    }

    /// What is asked of a surface: as recorded, with the changes of the options.
    pub(super) fn over(&self, recorded: &Specification) -> Result<Specification, CliError> {
        let changes = self.changes();
        let given = Profile::of(&changes)?.target.specification();
        let has = |key: &str| changes.iter().any(|change| change.key.starts_with(key));
        let by = |key, given: &Specification| if has(key) { given.clone() } else { recorded.clone() };
        Ok(Specification {
            tolerance: by("target.tolerance", &given).tolerance,
            rule: Rule {
                decision: by("target.decision_rule", &given).rule.decision,
                risk: by("target.risk", &given).rule.risk,
            },
        })
    }

    /// Ends a verb whose result is printed: a verdict that is no pass is its exit code. A surface with limits that could
    /// not be measured is undecided. A program that called the verb reads the verdict in the result.
    pub(super) fn end(
        &self,
        surface: Option<&SurfaceSummary>,
        sequence: &Sequence,
        talk: &Talk,
    ) -> Result<(), CliError> {
        if self.no_verdict || talk.has_caller() {
            return Ok(());
        }
        let verdict = match surface {
            Some(surface) => surface.conclusion.verdict,
            None if self.has_limits(sequence)? => {
                talk.say("the verdict is undecided, because the surface was not measured");
                Some(Verdict::Undecided)
            }
            None => None,
        };
        let ended = |blame| Err(CliError::new(blame, "the verdict"));
        match verdict {
            None | Some(Verdict::Pass) => Ok(()),
            Some(Verdict::Fail) => ended(Blame::NotConforming),
            Some(Verdict::Undecided) => ended(Blame::Undecided),
        }
    }

    fn has_limits(&self, sequence: &Sequence) -> Result<bool, CliError> {
        let recorded = Profile::of_sequence(sequence).ok().flatten().unwrap_or(Profile::of(&[])?);
        Ok(!self.over(&recorded.target.specification())?.tolerance.limits().is_empty())
    }
}

/// What was found, and the verdict if there is one: a line each.
pub(super) fn answer(surface: &SurfaceSummary) -> String {
    let conclusion = &surface.conclusion;
    let verdict = conclusion.verdict_sentence.as_ref();
    format!("{}\n{}", conclusion.sentence, verdict.map_or(String::new(), |words| format!("{words}\n")))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_option_is_a_key_of_the_profile() {
        // A key that is missing in the profile would be left out silently.
        assert_eq!(VerdictKeys::options().len(), 3);
    }
}
