//! The section `report`: what a report says of the object and of the measurement beside the results.

use super::section::{Kind, section};

section! {
    /// What the report says beside the results, as text, and what stands over it.
    pub struct ReportProfile in "report" {
        /// Who ordered the measurement.
        "customer" => customer: Option<String> = Kind::Text, like "Example Ltd, order 4711";
        /// The object.
        "object" => object: Option<String> = Kind::Text, like "tile, back";
        /// Serial number of the object.
        "serial_number" => serial_number: Option<String> = Kind::Text, like "T-0042";
        /// Who measured.
        "operator" => operator: Option<String> = Kind::Text, like "A. Example";
        /// Where.
        "place" => place: Option<String> = Kind::Text, like "laboratory 3";
        /// Temperature of the object, with its unit.
        "temperature" => temperature: Option<String> = Kind::Text, like "20.4 +- 0.5 deg C";
        /// Numbers of the instruments, by which they are known in the place.
        "instrument" => instrument: Option<String> = Kind::Text, like "rig 2, camera K-17, stage S-3";
        /// The procedure, with its issue.
        "procedure" => procedure: Option<String> = Kind::Text, like "WI-12, issue 3";
        /// Picture at the top of the report: a PNG or JPEG file, as seen from the working folder.
        "logo" => logo: Option<String> = Kind::Text, like "logo.png";
    }
}

impl ReportProfile {
    /// What is given as text: each with its name in words, in the order of a report.
    pub fn rows(&self) -> Vec<(String, &str)> {
        let values = [
            &self.customer,
            &self.object,
            &self.serial_number,
            &self.operator,
            &self.place,
            &self.temperature,
            &self.instrument,
            &self.procedure,
        ];
        let named = Self::SECTION.keys.iter().zip(values);
        named.filter_map(|(key, value)| Some((key.name.replace('_', " "), value.as_deref()?))).collect()
    }

    /// The same, with what `other` gives in the place of what this one does.
    #[must_use]
    pub fn replaced_by(self, other: Self) -> Self {
        Self {
            customer: other.customer.or(self.customer),
            object: other.object.or(self.object),
            serial_number: other.serial_number.or(self.serial_number),
            operator: other.operator.or(self.operator),
            place: other.place.or(self.place),
            temperature: other.temperature.or(self.temperature),
            instrument: other.instrument.or(self.instrument),
            procedure: other.procedure.or(self.procedure),
            logo: other.logo.or(self.logo),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_row_has_the_name_of_its_key() {
        let text = |text: &str| Some(text.to_owned());
        let all = ReportProfile {
            customer: text("customer"),
            object: text("object"),
            serial_number: text("serial number"),
            operator: text("operator"),
            place: text("place"),
            temperature: text("temperature"),
            instrument: text("instrument"),
            procedure: text("procedure"),
            logo: text("logo.png"),
        };
        // The logo is no text.
        assert_eq!(all.rows().len(), ReportProfile::SECTION.keys.len() - 1);
        assert!(all.rows().iter().all(|(name, value)| name == value), "{:?}", all.rows());
        assert_eq!(ReportProfile::default().rows(), []);
        assert_eq!(ReportProfile::default().replaced_by(all.clone()), all);
        assert_eq!(all.clone().replaced_by(ReportProfile::default()), all);
    }
}
