//! Selection of a port: by path, by USB serial number, or by USB vendor and product.

use std::fmt;
use std::str::FromStr;

use super::LinkError;

/// A serial port of the system.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct PortFacts {
    /// Path of the device.
    pub path: String,
    /// The USB device behind it, if there is one.
    pub usb: Option<UsbFacts>,
}

/// What a USB device reports.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct UsbFacts {
    /// Vendor id.
    pub vendor: u16,
    /// Product id.
    pub product: u16,
    /// Serial number; cheap adapters have none, or all the same one.
    pub serial_number: Option<String>,
    /// Name of the manufacturer.
    pub manufacturer: Option<String>,
    /// Name of the product.
    pub name: Option<String>,
}

impl fmt::Display for PortFacts {
    fn fmt(&self, to: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(to, "{}", self.path)?;
        let Some(usb) = &self.usb else { return Ok(()) };
        write!(to, " (usb:{:04x}:{:04x}", usb.vendor, usb.product)?;
        if let Some(serial_number) = &usb.serial_number {
            write!(to, ", usb:{serial_number}")?;
        }
        let names: Vec<&str> =
            [&usb.manufacturer, &usb.name].into_iter().flatten().map(String::as_str).collect();
        if !names.is_empty() {
            write!(to, ", {}", names.join(" "))?;
        }
        write!(to, ")")
    }
}

/// The selection of a port.
///
/// ```
/// use epirig_devices::link::PortChoice;
///
/// assert_eq!("/dev/ttyUSB0".parse(), Ok(PortChoice::Path("/dev/ttyUSB0".into())));
/// assert_eq!("usb:2341:0043".parse(), Ok(PortChoice::UsbProduct { vendor: 0x2341, product: 0x0043 }));
/// assert_eq!("usb:75830303934351618212".parse(), Ok(PortChoice::UsbSerial("75830303934351618212".into())));
/// ```
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum PortChoice {
    /// The only USB serial port.
    Any,
    /// By path, which may be a symbolic link.
    Path(String),
    /// `usb:SERIAL`.
    UsbSerial(String),
    /// `usb:VID:PID`, both as four hexadecimal digits.
    UsbProduct {
        /// Vendor.
        vendor: u16,
        /// Product.
        product: u16,
    },
}

impl FromStr for PortChoice {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let Some(usb) = text.strip_prefix("usb:") else {
            return if text.is_empty() {
                Err("a port is a path such as /dev/ttyUSB0, usb:SERIAL or usb:VID:PID".to_owned())
            } else {
                Ok(Self::Path(text.to_owned()))
            };
        };
        let hexadecimal =
            |digits: &str| (digits.len() == 4).then(|| u16::from_str_radix(digits, 16).ok()).flatten();
        match usb.split_once(':').map(|(vendor, product)| (hexadecimal(vendor), hexadecimal(product))) {
            Some((Some(vendor), Some(product))) => Ok(Self::UsbProduct { vendor, product }),
            _ if usb.is_empty() => Err("usb: must be followed by a serial number or VID:PID".to_owned()),
            // Serial numbers may hold colons.
            _ => Ok(Self::UsbSerial(usb.to_owned())),
        }
    }
}

impl fmt::Display for PortChoice {
    fn fmt(&self, to: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Any => write!(to, "a USB serial port"),
            Self::Path(path) => write!(to, "{path}"),
            Self::UsbSerial(serial_number) => write!(to, "usb:{serial_number}"),
            Self::UsbProduct { vendor, product } => write!(to, "usb:{vendor:04x}:{product:04x}"),
        }
    }
}

impl PortChoice {
    fn fits(&self, port: &PortFacts) -> bool {
        match (self, &port.usb) {
            (Self::Path(path), _) => *path == port.path,
            (_, None) => false,
            (Self::Any, Some(_)) => true,
            (Self::UsbSerial(wanted), Some(usb)) => usb.serial_number.as_ref() == Some(wanted),
            (Self::UsbProduct { vendor, product }, Some(usb)) => {
                (*vendor, *product) == (usb.vendor, usb.product)
            }
        }
    }
}

/// The path of the only port among `ports` that matches. A path is returned unchanged, because links and
/// unlisted ports are valid too.
///
/// # Errors
/// [`LinkError::NoMatch`] if none matches, [`LinkError::Ambiguous`] if several do.
pub fn choose(choice: &PortChoice, ports: &[PortFacts]) -> Result<String, LinkError> {
    if let PortChoice::Path(path) = choice {
        return Ok(path.clone());
    }
    let list = |ports: &[&PortFacts]| {
        let lines: Vec<String> = ports.iter().map(ToString::to_string).collect();
        if lines.is_empty() { "nothing".to_owned() } else { lines.join(", ") }
    };
    let fitting: Vec<&PortFacts> = ports.iter().filter(|port| choice.fits(port)).collect();
    match fitting[..] {
        [port] => Ok(port.path.clone()),
        [] => Err(LinkError::NoMatch {
            wanted: choice.to_string(),
            connected: list(&ports.iter().collect::<Vec<_>>()),
        }),
        _ => Err(LinkError::Ambiguous { wanted: choice.to_string(), candidates: list(&fitting) }),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn usb(path: &str, vendor: u16, product: u16, serial_number: Option<&str>) -> PortFacts {
        let serial_number = serial_number.map(str::to_owned);
        let usb =
            UsbFacts { vendor, product, serial_number, manufacturer: None, name: Some("Uno".to_owned()) };
        PortFacts { path: path.to_owned(), usb: Some(usb) }
    }

    fn bench() -> Vec<PortFacts> {
        vec![
            PortFacts { path: "/dev/ttyS0".to_owned(), usb: None },
            usb("/dev/ttyACM0", 0x2341, 0x43, Some("A1")),
            usb("/dev/ttyUSB0", 0x1a86, 0x7523, None),
            usb("/dev/ttyUSB1", 0x1a86, 0x7523, None),
        ]
    }

    #[test]
    fn one_fitting_port_is_taken_and_more_are_refused() {
        let pick = |text: &str| choose(&text.parse().unwrap(), &bench());
        assert_eq!(pick("usb:A1").unwrap(), "/dev/ttyACM0");
        assert_eq!(pick("usb:2341:0043").unwrap(), "/dev/ttyACM0");
        assert_eq!(pick("/dev/my-link").unwrap(), "/dev/my-link");
        let error = pick("usb:1a86:7523").unwrap_err().to_string();
        assert_eq!(
            error,
            "usb:1a86:7523 could be any of /dev/ttyUSB0 (usb:1a86:7523, Uno), /dev/ttyUSB1 (usb:1a86:7523, Uno); \
             choose one with --port"
        );
        let error = pick("usb:B2").unwrap_err().to_string();
        let there = "/dev/ttyS0, /dev/ttyACM0 (usb:2341:0043, usb:A1, Uno)";
        assert!(error.starts_with(&format!("usb:B2 is not connected (connected: {there}")), "{error}");
        assert!(matches!(choose(&PortChoice::Any, &bench()), Err(LinkError::Ambiguous { .. })));
        assert_eq!(choose(&PortChoice::Any, &bench()[..2]).unwrap(), "/dev/ttyACM0");
        assert!(matches!(choose(&PortChoice::Any, &[]), Err(LinkError::NoMatch { .. })));
    }

    #[test]
    fn nonsense_is_no_choice() {
        assert!("".parse::<PortChoice>().is_err());
        assert!("usb:".parse::<PortChoice>().is_err());
        assert_eq!("usb:12:34".parse(), Ok(PortChoice::UsbSerial("12:34".to_owned())));
    }
}
