//! Speed against accuracy: the settings that apply to a scene ([`setting`]), their times and their errors against a
//! reference ([`measure`]), a check of the reference ([`oracle`]), the Pareto front ([`pareto`]), and the table of
//! all of it, which can be read back ([`table`]). [`report`] formats it as a page and a plot, [`ladder`] makes it a ladder
//! of the viewer's quality controller, which itself knows no table.

pub(crate) mod ladder;
pub(crate) mod measure;
pub(crate) mod oracle;
pub(crate) mod pareto;
mod rendering;
pub(crate) mod report;
pub(crate) mod setting;
pub(crate) mod steps;
pub(crate) mod table;
