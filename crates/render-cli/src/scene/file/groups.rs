//! Whether groups within groups come to an end, and to how many objects.

use std::collections::BTreeMap;

use super::{ObjectFile, ShapeFile};
use crate::scene::build::MAX_OBJECTS;

/// Most groups that stand within each other.
const MAX_NESTING: usize = 64;

/// Whether `objects` are at most [`MAX_OBJECTS`], with those of `groups` counted each time that they
/// stand there, and no group stands in itself or too deep in others. Every group that an object names
/// is one.
pub(super) fn check(
    groups: &BTreeMap<String, Vec<ObjectFile>>,
    objects: &[ObjectFile],
) -> Result<(), String> {
    let mut counter = Counter { groups, known: BTreeMap::new(), within: Vec::new() };
    for name in groups.keys() {
        counter.group(name)?;
    }
    counter.objects("objects", objects).map(|_| ())
}

/// What a group comes to.
#[derive(Clone, Copy)]
struct Extent {
    /// At least 1, as looking into an empty group takes its time too.
    objects: usize,
    /// Groups within each other, itself among them.
    nesting: usize,
}

struct Counter<'a> {
    groups: &'a BTreeMap<String, Vec<ObjectFile>>,
    known: BTreeMap<&'a str, Extent>,
    /// The groups around the one that is looked at, and itself.
    within: Vec<&'a str>,
}

impl<'a> Counter<'a> {
    fn group(&mut self, name: &'a str) -> Result<Extent, String> {
        let known = self.known.get(name).copied();
        if let Some(start) = self.within.iter().position(|outer| *outer == name) {
            let around: Vec<_> = self.within[start..].iter().rev().copied().collect();
            let cycle = around.join(" in ");
            return Err(format!(
                "groups.{name}: found {name} in {cycle}, expected no group in itself"
            ));
        }
        if self.within.len() + known.map_or(1, |extent| extent.nesting) > MAX_NESTING {
            let outermost = self.within[0];
            return Err(format!(
                "groups.{outermost}: found more than {MAX_NESTING} groups within each other, expected fewer"
            ));
        }
        if let Some(extent) = known {
            return Ok(extent);
        }
        self.within.push(name);
        let Extent { objects, nesting } =
            self.objects(&format!("groups.{name}"), &self.groups[name])?;
        self.within.pop();
        let extent = Extent { objects: objects.max(1), nesting: nesting + 1 };
        self.known.insert(name, extent);
        Ok(extent)
    }

    fn objects(&mut self, list: &str, objects: &'a [ObjectFile]) -> Result<Extent, String> {
        let mut sum = Extent { objects: 0, nesting: 0 };
        for (index, object) in objects.iter().enumerate() {
            let one = match &object.shape {
                ShapeFile::Group { name } => self.group(name)?,
                _ => Extent { objects: 1, nesting: 0 },
            };
            sum.objects += one.objects;
            sum.nesting = sum.nesting.max(one.nesting);
            if sum.objects > MAX_OBJECTS {
                return Err(format!(
                    "{list}[{index}]: found more than {MAX_OBJECTS} objects up to here, those of groups counted each \
                     time, expected fewer"
                ));
            }
        }
        Ok(sum)
    }
}
