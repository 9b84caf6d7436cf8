//! What JSON Schemas tell of parameters: meanings, units and ranges, from [`Yarn::parameters`].

use schemars::Schema;
use schemars::transform::transform_subschemas;

use crate::parameter::Parameter;
use crate::yarn::Yarn;

/// Gives each property that is called as a parameter of a yarn is the range of that.
pub(crate) fn add_ranges(schema: &mut Schema) {
    each_parameter(schema, "", &set_range);
}

/// Gives each parameter of a partial yarn its meaning, unit and range.
pub(crate) fn describe_yarn(schema: &mut Schema) {
    each_parameter(schema, "", &describe);
}

/// Gives each parameter of partial irregularities its meaning, unit and range.
pub(crate) fn describe_noise(schema: &mut Schema) {
    each_parameter(schema, "noise.", &describe);
}

/// Calls `visit` with all properties in `schema`, however deep, whose names after `prefix` are those
/// of parameters.
fn each_parameter(schema: &mut Schema, prefix: &str, visit: &dyn Fn(&Parameter, &mut Schema)) {
    let properties = schema.get_mut("properties").and_then(|properties| properties.as_object_mut());
    for (name, value) in properties.into_iter().flatten() {
        let parameter = Yarn::parameter(&format!("{prefix}{name}"));
        if let (Some(parameter), Ok(property)) = (parameter, <&mut Schema>::try_from(value)) {
            visit(parameter, property);
        }
    }
    transform_subschemas(&mut |schema: &mut Schema| each_parameter(schema, prefix, visit), schema);
}

fn set_range(parameter: &Parameter, schema: &mut Schema) {
    schema.insert("minimum".to_owned(), parameter.low.into());
    schema.insert("maximum".to_owned(), parameter.high.into());
}

fn describe(parameter: &Parameter, schema: &mut Schema) {
    let Parameter { meaning, unit, .. } = parameter;
    let unit = if unit.is_empty() { "1" } else { unit };
    schema.insert("description".to_owned(), format!("{meaning}: {unit}").into());
    set_range(parameter, schema);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Fabric, Highlight};

    #[test]
    fn every_parameter_has_its_meaning_and_range() {
        let schema = schemars::schema_for!(Fabric);
        for parameter in Yarn::parameters() {
            let place = match parameter.name.strip_prefix("noise.") {
                None => format!("/$defs/PartialYarn/properties/{}", parameter.name),
                Some(name) => format!("/$defs/PartialNoise/properties/{name}"),
            };
            let found = schema.pointer(&place).unwrap_or_else(|| panic!("no {place}"));
            assert_eq!(found["minimum"], parameter.low, "{place}");
            assert_eq!(found["maximum"], parameter.high, "{place}");
            let description = found["description"].as_str().unwrap();
            assert!(description.starts_with(parameter.meaning), "{place}: {description}");
        }
    }

    #[test]
    fn parameters_of_choices_have_ranges_too() {
        let schema = schemars::schema_for!(Highlight);
        let sigma = schema.pointer("/oneOf/1/properties/rough/properties/sigma").unwrap();
        assert_eq!((&sigma["minimum"], &sigma["maximum"]), (&5e-3.into(), &1.0.into()), "{sigma}");
    }
}
