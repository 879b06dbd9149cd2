//! Speed against accuracy, measured: which settings a scene has ([`setting`]), what each costs and how far its picture is from the
//! reference ([`measure`]), whether the reference is right ([`oracle`]), which of them are worth having ([`pareto`]), and a table of it
//! that can be read back ([`table`]). [`report`] shows it to people.

pub(crate) mod ladder;
pub(crate) mod measure;
pub(crate) mod oracle;
pub(crate) mod pareto;
pub(crate) mod report;
pub(crate) mod setting;
pub(crate) mod steps;
pub(crate) mod table;
