//! Controls.

use std::io;

use v4l::v4l_sys as sys;
use v4l::v4l2::vidioc;

use super::call::{Node, QUERY_EXT_CTRL, QUERYMENU, Request, has_none, text, zeroed};

/// Selects present values, for controls of any class.
const CURRENT_VALUES: u32 = 0;
pub(crate) const NEXT_CONTROL: u32 = 0x8000_0000 | 0x4000_0000;

/// The driver's name of a control.
pub(crate) fn title(query: &sys::v4l2_query_ext_ctrl) -> String {
    text(&query.name.map(|character| character as u8))
}

impl Node {
    /// The control with this id, if there is one; with [`NEXT_CONTROL`], the one after it, of any kind.
    pub(crate) fn query_control(&self, id: u32) -> io::Result<Option<sys::v4l2_query_ext_ctrl>> {
        let mut found = sys::v4l2_query_ext_ctrl { id, ..zeroed() };
        match self.call(QUERY_EXT_CTRL, &mut found) {
            // No more controls, or none at all.
            Err(error) if has_none(&error) => return Ok(None),
            done => done?,
        }
        Ok(Some(found))
    }

    /// The name of a menu item; its number, for a menu of numbers. `None` for a missing item.
    pub(crate) fn menu_item(&self, id: u32, index: u32, of_numbers: bool) -> Option<String> {
        let mut found = sys::v4l2_querymenu { id, index, ..zeroed() };
        self.call(QUERYMENU, &mut found).ok()?;
        // SAFETY: the members of the union are bytes and a number, valid whatever was written. It is packed:
        // they are copied.
        let (name, value) = unsafe { (found.__bindgen_anon_1.name, found.__bindgen_anon_1.value) };
        Some(if of_numbers { value.to_string() } else { text(&name) })
    }

    /// The value of a control; `wide` for 64 bits.
    pub(crate) fn control(&self, id: u32, wide: bool) -> io::Result<i64> {
        let mut control = [sys::v4l2_ext_control { id, ..zeroed() }];
        self.exchange(vidioc::VIDIOC_G_EXT_CTRLS, &mut control)?;
        Ok(value_of(&control[0], wide))
    }

    /// The values of several controls, in one call.
    pub(crate) fn several_controls(&self, wanted: &[(u32, bool)]) -> io::Result<Vec<i64>> {
        let empty = |(id, _): &(u32, bool)| sys::v4l2_ext_control { id: *id, ..zeroed() };
        let mut controls: Vec<sys::v4l2_ext_control> = wanted.iter().map(empty).collect();
        self.exchange(vidioc::VIDIOC_G_EXT_CTRLS, &mut controls)?;
        Ok(controls.iter().zip(wanted).map(|(control, (_, wide))| value_of(control, *wide)).collect())
    }

    pub(crate) fn set_control(&self, id: u32, value: i64, wide: bool) -> io::Result<()> {
        let mut control = [sys::v4l2_ext_control { id, ..zeroed() }];
        if wide {
            control[0].__bindgen_anon_1.value64 = value;
        } else {
            // Masks of 32 bits are signed here.
            control[0].__bindgen_anon_1.value = value as i32;
        }
        self.exchange(vidioc::VIDIOC_S_EXT_CTRLS, &mut control)
    }

    /// A call for numeric controls; others are refused.
    fn exchange(&self, request: Request, controls: &mut [sys::v4l2_ext_control]) -> io::Result<()> {
        let count = u32::try_from(controls.len()).map_err(io::Error::other)?;
        let mut all = sys::v4l2_ext_controls { count, controls: controls.as_mut_ptr(), ..zeroed() };
        all.__bindgen_anon_1.which = CURRENT_VALUES;
        let takes_controls = [vidioc::VIDIOC_G_EXT_CTRLS, vidioc::VIDIOC_S_EXT_CTRLS].contains(&request);
        // They are packed: sizes are copied.
        if !takes_controls || controls.iter().any(|control| { control.size } != 0) {
            return Err(io::Error::other("a call for other controls than numbers"));
        }
        // SAFETY: the number is one of two that take this structure. Its one pointer is to `controls`, which
        // is borrowed exclusively and holds `count` of them; these state no payload, as just checked, so the
        // kernel follows no pointer in them.
        unsafe { self.call_with_pointers(request, &mut all) }
    }
}

fn value_of(control: &sys::v4l2_ext_control, wide: bool) -> i64 {
    let value = control.__bindgen_anon_1;
    // SAFETY: the union is of numbers and pointers; as a number it is valid whatever was written. It is
    // packed: it is copied.
    unsafe { if wide { value.value64 } else { i64::from(value.value) } }
}
