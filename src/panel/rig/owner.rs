//! The one thread that owns stage and camera, and obeys orders.

use std::sync::Arc;
use std::time::Duration;

use super::camera::CameraSide;
use super::stage::{Connector, StageSide};
use crate::capture::CapturePlan;
use crate::doctor::{DoctorPlan, examine};
use crate::panel::live_map::LiveMapMaker;
use crate::panel::scan::{Notes, ScanRun, run_scan};
use crate::panel::shared::{Order, SharedState};
use crate::panel::state::{DoctorState, Presence, TaskKind};
use crate::profile::Profile;
use crate::rig::{RigStage, capture_plan};
use epirig_data::storage::free_bytes;

/// How long an order may wait for while no picture is wanted.
const IDLE: Duration = Duration::from_millis(200);

/// Owns the rig until the panel ends.
pub(super) fn own(shared: &Arc<SharedState>) {
    while !shared.is_ending() {
        // A draft is checked before it is used.
        let profile = match shared.draft().profile() {
            Ok(profile) => profile,
            Err(error) => return shared.fail(error.to_string()),
        };
        match RigStage::of(&profile) {
            Ok(source) => Owner::new(shared, &profile, source).work(),
            Err(error) => without_stage(shared, &error.to_string()),
        }
    }
}

/// Waits for another profile where this one has no stage that could be connected.
fn without_stage(shared: &SharedState, why: &str) {
    shared.fail(why);
    shared.change(|state| {
        (state.rig.stage.state, state.rig.stage.error) = (Presence::Lost, Some(why.to_owned()))
    });
    loop {
        match shared.next_order(IDLE) {
            None => {}
            Some(Order::End) => return,
            Some(order @ (Order::Connect | Order::Use { .. })) => return begin_anew(shared, order),
            Some(Order::SetControl { reply, .. }) => reply.give(Err(why.to_owned())),
            // Nothing moves, and nothing can be done.
            Some(_) => shared.stands(),
        }
    }
}

/// Obeys an order to open stage and camera anew, as far as that can be done before they are opened.
fn begin_anew(shared: &SharedState, order: Order) {
    // From here on nothing that is told of them belongs to the profile before.
    shared.change(|state| {
        (state.rig.camera.state, state.rig.stage.state) = (Presence::Connecting, Presence::Connecting);
    });
    if let Order::Use { values, reply } = order {
        let draft = shared.draft().changed(&values);
        // Read once more: a control may have been set since the page was told that the values are right.
        reply.give(match draft.profile() {
            Ok(_) => {
                shared.change(|state| state.draft = draft);
                Ok(())
            }
            Err(error) => Err(error.to_string()),
        });
    }
    shared.end_task();
}

struct Owner<'a> {
    shared: &'a Arc<SharedState>,
    profile: &'a Profile,
    camera: CameraSide<'a>,
    stage: StageSide<'a>,
    /// Makes the live map of the latest scan, also when its frames are all there.
    map: Option<LiveMapMaker>,
}

impl<'a> Owner<'a> {
    fn new(shared: &'a Arc<SharedState>, profile: &'a Profile, source: RigStage<'a>) -> Self {
        let connector = Connector::new(source, shared);
        let camera = CameraSide::new(shared, profile, connector.watch());
        let stage = StageSide::new(shared, profile, connector);
        Self { shared, profile, camera, stage, map: None }
    }

    /// Obeys until another profile is to be used, or the panel ends.
    fn work(mut self) {
        let free = free_bytes(&self.shared.folder);
        self.shared.change(|state| {
            (state.rig.camera.state, state.rig.camera.error) = (Presence::Connecting, None);
            (state.rig.stage.state, state.rig.stage.error) = (Presence::Connecting, None);
            state.rig.free_bytes = free;
        });
        loop {
            self.camera.open();
            self.stage.open();
            let patience = if self.camera.is_busy() { Duration::ZERO } else { IDLE };
            match self.shared.next_order(patience) {
                Some(order @ (Order::Connect | Order::Use { .. })) => return begin_anew(self.shared, order),
                Some(Order::End) => return,
                Some(order) => self.obey(order),
                None => self.camera.pump(),
            }
        }
    }

    fn obey(&mut self, order: Order) {
        let Self { camera, stage, .. } = self;
        match order {
            Order::Home => {
                stage.during(TaskKind::Homing, "homing".to_owned(), |stage| stage.home(), || camera.pump());
            }
            Order::Go { mm } => {
                let words = format!("moving to {mm:.3} mm");
                stage.during(TaskKind::Moving, words, |stage| stage.move_to(mm), || camera.pump());
            }
            Order::Step { mm } => {
                let words = format!("moving by {mm} mm");
                let act = |stage: &mut dyn epirig_devices::stage::Stage| {
                    let from_mm = stage.position_mm()?;
                    stage.move_to(from_mm + mm)
                };
                stage.during(TaskKind::Moving, words, act, || camera.pump());
            }
            Order::Jog { id, up, fast } => {
                stage.jog(id, up, fast, || camera.pump());
                self.shared.end_task();
            }
            Order::Stopped => stage.stand(),
            Order::SetControl { name, value, reply } => reply.give(camera.set_control(&name, &value)),
            Order::Show(what) => camera.show(what),
            Order::Examine { short } => {
                if let Err(why) = self.examine(short) {
                    self.shared.fail(why);
                }
                self.shared.end_task();
            }
            Order::Scan { name, resumed } => {
                if let Err(why) = self.scan(&name, resumed) {
                    self.shared.fail(why);
                }
                self.shared.end_task();
            }
            // The loop ends with these.
            Order::Connect | Order::Use { .. } | Order::End => {}
        }
    }

    fn plan(&self) -> Result<CapturePlan, String> {
        capture_plan(self.profile).map_err(|error| error.to_string())
    }

    fn examine(&mut self, short: bool) -> Result<(), String> {
        let plan = DoctorPlan {
            scan: self.plan()?,
            distance_mm: self.profile.optics.distance_mm,
            relief_mm: self.profile.target.relief_mm,
            mains_hz: self.profile.camera.mains_hz,
            free_bytes: free_bytes(&self.shared.folder),
            short,
        };
        let stage = self.stage.lend()?;
        let camera = self.camera.lend()?;
        let examined = examine(&mut **stage, &mut **camera, &plan, &Notes(self.shared));
        self.stage.released();
        self.camera.released();
        let report = examined.map_err(|error| error.to_string())?;
        self.shared.change(|state| state.rig.doctor = Some(DoctorState::of(report, short)));
        Ok(())
    }

    fn scan(&mut self, name: &str, resumed: bool) -> Result<(), String> {
        self.stage.give_up();
        self.map = None;
        let view = self.camera.view();
        let camera = self.camera.lend()?;
        let run = ScanRun { shared: self.shared, name, resumed, view };
        let done = run_scan(&run, self.profile, &mut self.stage.connector, &mut **camera);
        self.camera.released();
        self.stage.open();
        let free = free_bytes(&self.shared.folder);
        self.shared.change(|state| state.rig.free_bytes = free);
        self.map = Some(done?);
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;
    use std::path::PathBuf;

    use super::*;
    use crate::panel::shared::PanelOptions;
    use crate::panel::shared::{OrderReply, PanelHooks};
    use crate::profile::Draft;

    struct NoHooks;

    impl PanelHooks for NoHooks {}

    fn values(key: &str, value: &str) -> BTreeMap<String, String> {
        BTreeMap::from([(key.to_owned(), value.to_owned())])
    }

    #[test]
    fn a_profile_is_changed_as_it_is_when_the_order_is_carried_out() {
        let draft = Draft::read("", "rig.toml", &[]).unwrap();
        let (source, nowhere) = ("rig.toml".to_owned(), PathBuf::new());
        let (file, folder) = (nowhere.clone(), nowhere);
        let shared = SharedState::new(PanelOptions { draft, source, file, folder, hooks: Box::new(NoHooks) });
        let (reply, answer) = OrderReply::new();
        let order = Order::Use { values: values("plan.frames", "7"), reply };
        // A control was ordered before, and is set while this order waits.
        let control = values("camera.exposure", "5 ms");
        shared.change(|state| state.draft = state.draft.changed(&control));
        begin_anew(&shared, order);
        assert_eq!(answer.recv().unwrap(), Ok(()));
        let draft = shared.draft();
        let found = ["plan.frames", "camera.exposure"].map(|key| draft.value_of(key));
        assert_eq!(found, [Some("7".to_owned()), Some("5 ms".to_owned())]);
        // What is no profile is refused, and changes nothing.
        let (reply, answer) = OrderReply::new();
        begin_anew(&shared, Order::Use { values: values("plan.frames", "none"), reply });
        assert!(answer.recv().unwrap().is_err());
        assert_eq!(shared.draft().value_of("plan.frames"), Some("7".to_owned()));
    }
}
