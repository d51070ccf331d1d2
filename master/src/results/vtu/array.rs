//! An array of a file: its description and its numbers.

use std::{io, io::Write};

/// Puts the little-endian components of one tuple into a buffer.
type Put<'a> = Box<dyn Fn(usize, &mut Vec<u8>) + 'a>;

/// One array of the file: its description and where its numbers come from.
pub(in crate::results) struct Array<'a> {
    pub(super) name: &'a str,
    /// VTK's name of the type.
    pub(super) kind: &'static str,
    /// Bytes per component.
    pub(super) width: usize,
    /// Components per tuple.
    pub(super) components: usize,
    pub(super) tuples: usize,
    /// Whether the components are told to the reader; otherwise the array is one long list.
    pub(super) grouped: bool,
    /// Whether it is the same in all states of a run.
    pub(super) constant: bool,
    pub(super) put: Put<'a>,
}

impl<'a> Array<'a> {
    pub(in crate::results) fn f64<const N: usize>(
        name: &'a str,
        tuples: usize,
        of: impl Fn(usize) -> [f64; N] + 'a,
    ) -> Self {
        let put: Put =
            Box::new(move |i, out| of(i).iter().for_each(|v| out.extend_from_slice(&v.to_le_bytes())));
        Self { name, kind: "Float64", width: 8, components: N, tuples, grouped: true, constant: false, put }
    }

    /// A list of indices, `N` per tuple; VTK refuses grouped ones.
    pub(in crate::results) fn i64<const N: usize>(
        name: &'a str,
        tuples: usize,
        of: impl Fn(usize) -> [i64; N] + 'a,
    ) -> Self {
        let put: Put =
            Box::new(move |i, out| of(i).iter().for_each(|v| out.extend_from_slice(&v.to_le_bytes())));
        Self { name, kind: "Int64", width: 8, components: N, tuples, grouped: false, constant: false, put }
    }

    pub(in crate::results) fn u32(name: &'a str, tuples: usize, of: impl Fn(usize) -> u32 + 'a) -> Self {
        let put: Put = Box::new(move |i, out| out.extend_from_slice(&of(i).to_le_bytes()));
        Self { name, kind: "UInt32", width: 4, components: 1, tuples, grouped: true, constant: false, put }
    }

    /// An array that is the same in all states of a run.
    pub(super) fn constant(self) -> Self {
        Self { constant: true, ..self }
    }

    /// The tuples of some elements alone, which are others in each state.
    pub(super) fn only(self, kept: &'a [usize]) -> Self {
        let put = self.put;
        Self { tuples: kept.len(), put: Box::new(move |i, out| put(kept[i], out)), constant: false, ..self }
    }

    /// Size of the numbers, without the header that precedes them.
    pub(super) fn n_bytes(&self) -> u64 {
        self.tuples as u64 * self.components as u64 * self.width as u64
    }

    /// The element that announces the array, which starts `offset` bytes into the appended data, with its unit.
    pub(super) fn describe(&self, out: &mut impl Write, offset: u64, unit: &str) -> io::Result<()> {
        write!(out, r#"        <DataArray type="{}" Name="{}""#, self.kind, self.name)?;
        if self.grouped && self.components != 1 {
            write!(out, r#" NumberOfComponents="{}""#, self.components)?;
        }
        if self.components == 6 {
            for (index, name) in ["XX", "YY", "ZZ", "XY", "YZ", "XZ"].iter().enumerate() {
                write!(out, r#" ComponentName{index}="{name}""#)?;
            }
        }
        write!(out, r#" format="appended" offset="{offset}""#)?;
        if unit.is_empty() {
            return writeln!(out, "/>");
        }
        writeln!(out, ">")?;
        // The key by which VTK keeps the unit of an array.
        writeln!(
            out,
            r#"          <InformationKey name="UNITS_LABEL" location="vtkDataArray">{unit}</InformationKey>"#
        )?;
        writeln!(out, "        </DataArray>")
    }
}
