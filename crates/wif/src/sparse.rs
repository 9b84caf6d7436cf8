//! Values by index where most indices may have none: how WIF writes per-thread data.
//!
//! Both types take memory in proportion to the values they hold, never to the largest index.

#[cfg(feature = "serde")]
use std::collections::BTreeMap;

/// One value each for some indices, in ascending order.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(
        from = "BTreeMap<u32, T>",
        into = "BTreeMap<u32, T>",
        bound(serialize = "T: Clone + serde::Serialize")
    )
)]
pub struct Sparse<T> {
    entries: Vec<(u32, T)>,
}

impl<T> Default for Sparse<T> {
    fn default() -> Self {
        Self { entries: Vec::new() }
    }
}

impl<T> Sparse<T> {
    /// From entries whose indices rise strictly.
    pub(crate) fn from_sorted(entries: Vec<(u32, T)>) -> Self {
        debug_assert!(entries.is_sorted_by(|a, b| a.0 < b.0));
        Self { entries }
    }

    fn position(&self, index: u32) -> Result<usize, usize> {
        // Lists that name every index, the usual case, are found without a search.
        match self.entries.get(index as usize) {
            Some(&(key, _)) if key == index => Ok(index as usize),
            _ => self.entries.binary_search_by_key(&index, |&(key, _)| key),
        }
    }

    /// The value at `index`, if it has one.
    pub fn get(&self, index: u32) -> Option<&T> {
        self.position(index).ok().map(|at| &self.entries[at].1)
    }

    /// Sets the value at `index` and returns the one it replaces.
    ///
    /// Appending takes constant time, inserting before others moves them.
    pub fn insert(&mut self, index: u32, value: T) -> Option<T> {
        match self.position(index) {
            Ok(at) => Some(std::mem::replace(&mut self.entries[at].1, value)),
            Err(at) => {
                self.entries.insert(at, (index, value));
                None
            }
        }
    }

    /// Removes and returns the value at `index`.
    pub fn remove(&mut self, index: u32) -> Option<T> {
        self.position(index).ok().map(|at| self.entries.remove(at).1)
    }

    /// The indices that have a value, with it, in ascending order.
    pub fn iter(&self) -> impl DoubleEndedIterator<Item = (u32, &T)> + ExactSizeIterator {
        self.entries.iter().map(|(index, value)| (*index, value))
    }

    /// How many indices have a value.
    pub fn len(&self) -> usize {
        self.entries.len()
    }

    /// Whether no index has a value.
    pub fn is_empty(&self) -> bool {
        self.entries.is_empty()
    }

    /// The largest index that has a value.
    pub fn last_index(&self) -> Option<u32> {
        self.entries.last().map(|&(index, _)| index)
    }
}

impl<T> FromIterator<(u32, T)> for Sparse<T> {
    /// Collects entries in any order; of several with one index the last is kept.
    fn from_iter<I: IntoIterator<Item = (u32, T)>>(entries: I) -> Self {
        let mut sparse = Self::default();
        let mut entries: Vec<_> = entries.into_iter().collect();
        entries.sort_by_key(|&(index, _)| index);
        for (index, value) in entries {
            sparse.insert(index, value);
        }
        sparse
    }
}

/// A list of numbers each for some indices, in ascending order: the shafts of each end, the
/// treadles of each pick.
///
/// An index may have an empty list (the file says "none") or no list (the file says nothing);
/// [`Lists::get`] is empty for both.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(from = "BTreeMap<u32, Vec<u32>>", into = "BTreeMap<u32, Vec<u32>>")
)]
pub struct Lists {
    keys: Vec<u32>,
    // Where the list of the key at the same place ends in `items`.
    ends: Vec<usize>,
    items: Vec<u32>,
}

impl Lists {
    fn position(&self, index: u32) -> Result<usize, usize> {
        match self.keys.get(index as usize) {
            Some(&key) if key == index => Ok(index as usize),
            _ => self.keys.binary_search(&index),
        }
    }

    fn start(&self, at: usize) -> usize {
        at.checked_sub(1).map_or(0, |before| self.ends[before])
    }

    /// The list at `index`, empty where there is none.
    pub fn get(&self, index: u32) -> &[u32] {
        self.position(index).map_or(&[], |at| &self.items[self.start(at)..self.ends[at]])
    }

    /// Sets the list at `index`.
    ///
    /// Appending takes constant time, inserting before others moves them.
    pub fn set(&mut self, index: u32, items: &[u32]) {
        if self.last_index().is_none_or(|last| last < index) {
            self.keys.push(index);
            self.items.extend_from_slice(items);
            self.ends.push(self.items.len());
            return;
        }
        let at = match self.position(index) {
            Ok(at) => {
                let (start, end) = (self.start(at), self.ends[at]);
                self.items.splice(start..end, items.iter().copied());
                for shifted in &mut self.ends[at..] {
                    *shifted = *shifted - (end - start) + items.len();
                }
                return;
            }
            Err(at) => at,
        };
        let start = self.start(at);
        self.items.splice(start..start, items.iter().copied());
        self.keys.insert(at, index);
        self.ends.insert(at, start);
        for shifted in &mut self.ends[at..] {
            *shifted += items.len();
        }
    }

    /// The indices that have a list, with it, in ascending order.
    pub fn iter(&self) -> impl Iterator<Item = (u32, &[u32])> {
        let mut start = 0;
        self.keys.iter().zip(&self.ends).map(move |(&key, &end)| {
            let list = &self.items[start..end];
            start = end;
            (key, list)
        })
    }

    /// Whether no index has a list, not even an empty one.
    pub fn is_empty(&self) -> bool {
        self.keys.is_empty()
    }

    /// How many indices have a list.
    pub fn len(&self) -> usize {
        self.keys.len()
    }

    /// The largest index that has a list.
    pub fn last_index(&self) -> Option<u32> {
        self.keys.last().copied()
    }

    /// The largest number in any list.
    pub fn max_item(&self) -> Option<u32> {
        self.items.iter().copied().max()
    }
}

impl<'a> FromIterator<(u32, &'a [u32])> for Lists {
    /// Collects lists, fastest in ascending order; of several with one index the last is kept.
    fn from_iter<I: IntoIterator<Item = (u32, &'a [u32])>>(lists: I) -> Self {
        let mut collected = Self::default();
        for (index, items) in lists {
            collected.set(index, items);
        }
        collected
    }
}

#[cfg(feature = "serde")]
impl<T> From<BTreeMap<u32, T>> for Sparse<T> {
    fn from(map: BTreeMap<u32, T>) -> Self {
        Self::from_sorted(map.into_iter().collect())
    }
}

#[cfg(feature = "serde")]
impl<T> From<Sparse<T>> for BTreeMap<u32, T> {
    fn from(sparse: Sparse<T>) -> Self {
        sparse.entries.into_iter().collect()
    }
}

#[cfg(feature = "serde")]
impl From<BTreeMap<u32, Vec<u32>>> for Lists {
    fn from(map: BTreeMap<u32, Vec<u32>>) -> Self {
        map.iter().map(|(&index, items)| (index, items.as_slice())).collect()
    }
}

#[cfg(feature = "serde")]
impl From<Lists> for BTreeMap<u32, Vec<u32>> {
    fn from(lists: Lists) -> Self {
        lists.iter().map(|(index, items)| (index, items.to_vec())).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sparse_keeps_order_and_replaces() {
        let mut sparse: Sparse<char> =
            [(7, 'c'), (0, 'a'), (7, 'd'), (3, 'b')].into_iter().collect();
        assert_eq!(
            sparse.iter().map(|(i, &v)| (i, v)).collect::<Vec<_>>(),
            [(0, 'a'), (3, 'b'), (7, 'd')]
        );
        assert_eq!(sparse.insert(3, 'x'), Some('b'));
        assert_eq!(
            (sparse.get(3), sparse.get(1), sparse.last_index()),
            (Some(&'x'), None, Some(7))
        );
        assert_eq!((sparse.remove(0), sparse.get(0), sparse.get(7)), (Some('a'), None, Some(&'d')));
    }

    #[test]
    fn lists_can_be_set_in_any_order() {
        let mut lists = Lists::default();
        lists.set(5, &[1, 2]);
        lists.set(0, &[9]);
        lists.set(3, &[]);
        lists.set(5, &[4, 5, 6]);
        lists.set(0, &[7, 8]);
        let all: Vec<_> = lists.iter().collect();
        assert_eq!(all, [(0, &[7, 8][..]), (3, &[]), (5, &[4, 5, 6])]);
        assert_eq!((lists.get(5), lists.get(4)), (&[4, 5, 6][..], &[][..]));
        assert_eq!((lists.len(), lists.last_index(), lists.max_item()), (3, Some(5), Some(8)));
    }
}
