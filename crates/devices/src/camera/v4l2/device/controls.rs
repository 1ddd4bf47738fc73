//! Controls of a video device.

use v4l::v4l_sys as sys;

use super::V4l2Device;
use crate::camera::automatic::known;
use crate::camera::v4l2::failure::failed;
use crate::camera::v4l2::kernel::{NEXT_CONTROL, title};
use crate::camera::{CameraError, Control, ControlKind};

impl V4l2Device {
    /// All controls with their values.
    pub(super) fn list_controls(&mut self) -> Result<Vec<Control>, CameraError> {
        let mut controls = Vec::new();
        let mut id = 0;
        loop {
            match self.node.query_control(id | NEXT_CONTROL).map_err(failed(&self.path, "list its controls"))
            {
                Ok(None) => break,
                // The numbers must rise, or the list would never end.
                Ok(Some(query)) if query.id <= id => break,
                Ok(Some(query)) => {
                    id = query.id;
                    controls.extend(self.control(query));
                }
                Err(gone @ CameraError::Gone { .. }) => return Err(gone),
                Err(_) => {
                    // A control that cannot be described hides all later ones (USB cameras have such
                    // controls). The relevant ones are requested by number.
                    for known in known().into_iter().filter(|known| *known > id) {
                        let query = self.node.query_control(known).ok().flatten();
                        controls.extend(query.and_then(|query| self.control(query)));
                    }
                    break;
                }
            }
        }
        Ok(controls)
    }

    /// The name of a control in commands; its number if the driver does not describe it.
    pub(super) fn control_name(&self, id: u32) -> String {
        let query = self.node.query_control(id).ok().flatten();
        query.map_or_else(|| format!("control {id:#x}"), |query| Control::command_name(&title(&query)))
    }

    fn control(&mut self, query: sys::v4l2_query_ext_ctrl) -> Option<Control> {
        let wide = query.type_ == sys::v4l2_ctrl_type_V4L2_CTRL_TYPE_INTEGER64;
        let simple = query.flags & sys::V4L2_CTRL_FLAG_HAS_PAYLOAD == 0 && query.elems <= 1;
        let kind = match query.type_ {
            sys::v4l2_ctrl_type_V4L2_CTRL_TYPE_CTRL_CLASS => return None,
            _ if query.flags & sys::V4L2_CTRL_FLAG_DISABLED != 0 => return None,
            _ if !simple => ControlKind::Other,
            sys::v4l2_ctrl_type_V4L2_CTRL_TYPE_INTEGER => ControlKind::Integer,
            sys::v4l2_ctrl_type_V4L2_CTRL_TYPE_INTEGER64 => ControlKind::Integer,
            sys::v4l2_ctrl_type_V4L2_CTRL_TYPE_BOOLEAN => ControlKind::Boolean,
            sys::v4l2_ctrl_type_V4L2_CTRL_TYPE_MENU | sys::v4l2_ctrl_type_V4L2_CTRL_TYPE_INTEGER_MENU => {
                ControlKind::Menu
            }
            sys::v4l2_ctrl_type_V4L2_CTRL_TYPE_BITMASK => ControlKind::Bitmask,
            sys::v4l2_ctrl_type_V4L2_CTRL_TYPE_BUTTON => ControlKind::Button,
            _ => ControlKind::Other,
        };
        if wide {
            self.wide.insert(query.id);
        }
        let unreadable = matches!(kind, ControlKind::Other | ControlKind::Button)
            || query.flags & sys::V4L2_CTRL_FLAG_WRITE_ONLY != 0;
        // One unreadable control must not hide the others.
        let value = if unreadable { None } else { self.node.control(query.id, wide).ok() };
        let items = if kind == ControlKind::Menu { self.menu(&query) } else { Vec::new() };
        Some(Control {
            id: query.id,
            name: Control::command_name(&title(&query)),
            kind,
            minimum: query.minimum,
            maximum: query.maximum,
            step: query.step,
            default: query.default_value,
            value,
            read_only: query.flags & sys::V4L2_CTRL_FLAG_READ_ONLY != 0,
            inactive: query.flags & sys::V4L2_CTRL_FLAG_INACTIVE != 0,
            items,
        })
    }

    fn menu(&self, query: &sys::v4l2_query_ext_ctrl) -> Vec<(i64, String)> {
        /// Longest menu; a damaged description might claim more.
        const LONGEST: i64 = 255;
        let of_numbers = query.type_ == sys::v4l2_ctrl_type_V4L2_CTRL_TYPE_INTEGER_MENU;
        let indices = query.minimum.max(0)..=query.maximum.min(LONGEST);
        let item = |index: i64| {
            let name = self.node.menu_item(query.id, u32::try_from(index).ok()?, of_numbers)?;
            Some((index, name))
        };
        indices.filter_map(item).collect()
    }
}
