//! The default scene: a sitting room in the late afternoon.

mod art;
mod bookcase;
mod floor;
mod garden;
mod lamps;
mod palette;
mod plan;
mod plants;
mod rug;
mod seating;
mod sideboard;
mod table;
mod tea;
mod walls;
mod windows;

use super::obj::Digits::{Coarse, Fine, Finest};
use super::obj::Shading::{Flat, Smooth};
use super::shape::Model;
use super::{Folder, Part};

/// Height of the cord of the hanging lamp: its light hangs this far below the ceiling.
const CORD: f64 = 1.12;

/// Everything in `models/room/`.
pub(crate) fn folder() -> Folder {
    let parts = vec![
        Part::new("walls", Flat, Fine, union([walls::walls(), windows::joinery()])),
        Part::new("garden", Smooth, Coarse, garden::garden()),
        Part::new("floor", Flat, Fine, floor::floor()),
        Part::new("rug", Flat, Coarse, rug::rug()),
        Part::new("drapery", Smooth, Coarse, drapery()),
        Part::new("sofa", Smooth, Fine, seating::sofa()),
        Part::new("armchair", Smooth, Fine, seating::armchair()),
        Part::new("table", Smooth, Fine, table::table()),
        Part::new("tray", Smooth, Finest, table::tray(0.27)),
        Part::new("teapot", Smooth, Finest, tea::teapot()),
        Part::new("cup", Smooth, Finest, tea::cup()),
        Part::new("sugar_bowl", Smooth, Finest, tea::sugar_bowl()),
        Part::new("fruit_bowl", Smooth, Finest, tea::fruit_bowl()),
        Part::new("bookcase", Flat, Fine, bookcase::case()),
        Part::new("books", Flat, Fine, bookcase::contents()),
        Part::new("ornaments", Smooth, Fine, bookcase::ornaments()),
        Part::new("picture_wide", Smooth, Fine, art::wide()),
        Part::new("picture_tall_a", Smooth, Fine, art::tall(2.3)),
        Part::new("picture_tall_b", Smooth, Fine, art::tall(3.1)),
        Part::new("fig", Smooth, Coarse, plants::fig()),
        Part::new("grasses", Smooth, Fine, plants::grasses()),
        Part::new("pendant", Smooth, Fine, lamps::pendant(CORD)),
        Part::new("reading_lamp", Smooth, Fine, lamps::reading_lamp()),
        Part::new("sideboard", Flat, Fine, sideboard::body()),
        Part::new("sideboard_turned", Smooth, Fine, sideboard::turned_parts()),
        Part::new("candlesticks", Smooth, Fine, sideboard::candlesticks()),
    ];
    Folder { name: "room", parts }
}

fn union(models: impl IntoIterator<Item = Model>) -> Model {
    models.into_iter().fold(Model::default(), |mut all, model| {
        all.include(model);
        all
    })
}

/// Curtains, rods, and the plaster rose on the ceiling.
fn drapery() -> Model {
    let mut model = windows::drapery();
    model.add(&palette::PLASTER, walls::rosette());
    model
}
