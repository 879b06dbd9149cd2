//! What the user does at the window, as minifb tells it, and what of it the camera and the overlay want to know.

use std::cell::RefCell;
use std::rc::Rc;

use minifb::{InputCallback, Key, MouseButton, MouseMode, Window};
use raw_window_handle::{HasWindowHandle, RawWindowHandle};

use crate::viewer::camera_control::{Held, Input};

/// Keys that went down or up, in order, since they were last asked for.
type Edges = Rc<RefCell<Vec<(Key, bool)>>>;

/// Hears every key, also one that is pressed and released between two updates: asking minifb which keys are down
/// misses those.
struct Listener(Edges);

impl InputCallback for Listener {
    fn add_char(&mut self, _character: u32) {}

    fn set_key_state(&mut self, key: Key, down: bool) {
        self.0.borrow_mut().push((key, down));
    }
}

/// Keyboard and mouse of one window.
#[derive(Debug)]
pub(super) struct Controls {
    edges: Edges,
    keyboard: Keyboard,
    mouse: Mouse,
    notches_per_unit: f64,
}

/// What happened since the last look.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Happened {
    /// For the camera.
    pub(super) camera: Input,
    /// H was pressed.
    pub(super) toggle_help: bool,
    /// O was pressed.
    pub(super) toggle_figures: bool,
    /// F was pressed.
    pub(super) toggle_accounts: bool,
    /// How often C was pressed.
    pub(super) next_coloring: usize,
    /// How often Tab was pressed.
    pub(super) select_next: usize,
    /// P was pressed.
    pub(super) toggle_pause: bool,
    /// L was pressed.
    pub(super) let_go: bool,
    /// K was pressed.
    pub(super) kick: bool,
    /// B was pressed.
    pub(super) bring_back: bool,
    /// Esc was pressed.
    pub(super) end: bool,
    /// A key is down or was, or the mouse has moved.
    pub(super) any: bool,
}

impl Happened {
    /// Whether workers are meant.
    pub(super) fn steers(&self) -> bool {
        let Self { toggle_accounts, select_next, toggle_pause, let_go, kick, bring_back, .. } = *self;
        toggle_accounts || select_next > 0 || toggle_pause || let_go || kick || bring_back
    }
}

impl Controls {
    /// Listens to `window` from now on.
    pub(super) fn of(window: &mut Window) -> Self {
        let edges = Edges::default();
        window.set_input_callback(Box::new(Listener(Rc::clone(&edges))));
        let system = window.window_handle().map(|handle| handle.as_raw());
        Self {
            edges,
            keyboard: Keyboard::default(),
            mouse: Mouse::default(),
            notches_per_unit: system.map_or(1.0, notches_per_unit),
        }
    }

    /// What happened since the last look; once per update of the window.
    pub(super) fn look(&mut self, window: &mut Window) -> Happened {
        let edges = std::mem::take(&mut *self.edges.borrow_mut());
        let strokes = self.keyboard.strokes(&edges, window.is_active());
        let at = window.get_unscaled_mouse_pos(MouseMode::Pass);
        let pressed = window.get_mouse_down(MouseButton::Left);
        let drag = self.mouse.drag(at, pressed, window.get_size().1);
        let wheel =
            window.get_scroll_wheel().map_or(0.0, |(_, units)| f64::from(units) * self.notches_per_unit);
        let moved = self.mouse.moved(window.get_unscaled_mouse_pos(MouseMode::Discard));
        Happened {
            any: moved || pressed || wheel != 0.0 || !strokes.held.is_empty(),
            camera: Input {
                held: held(&strokes.held),
                drag,
                wheel,
                reset: strokes.pressed.contains(&Key::R),
            },
            toggle_help: strokes.toggled(Key::H),
            toggle_figures: strokes.toggled(Key::O),
            toggle_accounts: strokes.toggled(Key::F),
            next_coloring: strokes.count(Key::C),
            select_next: strokes.count(Key::Tab),
            toggle_pause: strokes.toggled(Key::P),
            let_go: strokes.pressed.contains(&Key::L),
            kick: strokes.pressed.contains(&Key::K),
            bring_back: strokes.pressed.contains(&Key::B),
            end: strokes.pressed.contains(&Key::Escape),
        }
    }
}

/// minifb hands on what each window system calls a notch of the wheel away from the user: X and macOS 1, Windows 12,
/// Wayland -10 (its axis points downwards, and compositors count ten to fifteen units a notch).
fn notches_per_unit(system: RawWindowHandle) -> f64 {
    match system {
        RawWindowHandle::Wayland(_) => -1.0 / 10.0,
        RawWindowHandle::Win32(_) => 1.0 / 12.0,
        _ => 1.0,
    }
}

/// Which keys are down.
#[derive(Debug, Default)]
struct Keyboard {
    down: Vec<Key>,
    was_active: bool,
}

/// Keys of one look.
#[derive(Debug, Default, PartialEq)]
struct Strokes {
    /// Down at any moment since the last look.
    held: Vec<Key>,
    /// Gone down since the last look, each time it did.
    pressed: Vec<Key>,
}

impl Strokes {
    /// Whether a switch that `key` turns has turned: twice is back again.
    fn toggled(&self, key: Key) -> bool {
        self.count(key) % 2 == 1
    }

    fn count(&self, key: Key) -> usize {
        self.pressed.iter().filter(|&&pressed| pressed == key).count()
    }
}

impl Keyboard {
    fn strokes(&mut self, edges: &[(Key, bool)], active: bool) -> Strokes {
        if self.was_active && !active {
            // The release of a held key goes to the window that has the keyboard now: nobody will tell us.
            self.down.clear();
        }
        self.was_active = active;
        let mut strokes = Strokes { held: self.down.clone(), pressed: Vec::new() };
        for &(key, down) in edges {
            let known = self.down.iter().position(|&held| held == key);
            match (down, known) {
                (true, None) => {
                    self.down.push(key);
                    strokes.pressed.push(key);
                    strokes.held.push(key);
                }
                (false, Some(place)) => {
                    self.down.swap_remove(place);
                }
                // A held key repeats itself; a key that was down when the window opened is released.
                (true, Some(_)) | (false, None) => {}
            }
        }
        strokes
    }
}

fn held(keys: &[Key]) -> Held {
    let is = |key| keys.contains(&key);
    Held {
        forward: is(Key::W),
        back: is(Key::S),
        left: is(Key::A),
        right: is(Key::D),
        up: is(Key::E),
        down: is(Key::Q),
        look_left: is(Key::Left),
        look_right: is(Key::Right),
        look_up: is(Key::Up),
        look_down: is(Key::Down),
    }
}

/// Where the mouse and a drag were last seen.
#[derive(Debug, Default)]
struct Mouse {
    at: Option<(f32, f32)>,
    dragged_from: Option<(f32, f32)>,
}

impl Mouse {
    /// Whether it has moved since the last look.
    fn moved(&mut self, at: Option<(f32, f32)>) -> bool {
        std::mem::replace(&mut self.at, at) != at
    }

    /// How far the pressed mouse moved since the last look, as shares of the window's height.
    fn drag(&mut self, at: Option<(f32, f32)>, pressed: bool, window_height: usize) -> (f64, f64) {
        let to = if pressed { at } else { None };
        let from = std::mem::replace(&mut self.dragged_from, to);
        let (Some(from), Some(to)) = (from, to) else { return (0.0, 0.0) };
        let height = window_height.max(1) as f64;
        (f64::from(to.0 - from.0) / height, f64::from(to.1 - from.1) / height)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_key_is_held_from_press_to_release() {
        let mut keyboard = Keyboard::default();
        let pressed = keyboard.strokes(&[(Key::W, true)], true);
        assert_eq!(pressed, Strokes { held: vec![Key::W], pressed: vec![Key::W] });
        assert_eq!(keyboard.strokes(&[], true), Strokes { held: vec![Key::W], pressed: vec![] });
        assert_eq!(keyboard.strokes(&[(Key::W, false)], true).held, [Key::W], "held until now");
        assert_eq!(keyboard.strokes(&[], true), Strokes::default());
    }

    #[test]
    fn a_tap_between_two_looks_is_heard() {
        let mut keyboard = Keyboard::default();
        let tap = keyboard.strokes(&[(Key::H, true), (Key::H, false)], false);
        assert!(tap.toggled(Key::H));
        assert_eq!(keyboard.strokes(&[], false), Strokes::default());
        let double = [(Key::H, true), (Key::H, false), (Key::H, true), (Key::H, false)];
        assert!(!keyboard.strokes(&double, false).toggled(Key::H));
    }

    #[test]
    fn a_repeating_key_is_pressed_once() {
        let mut keyboard = Keyboard::default();
        assert_eq!(keyboard.strokes(&[(Key::H, true); 5], true).pressed, [Key::H]);
        assert_eq!(keyboard.strokes(&[(Key::H, true)], true).pressed, []);
    }

    #[test]
    fn a_window_that_loses_the_keyboard_lets_go_of_all_keys() {
        let mut keyboard = Keyboard::default();
        keyboard.strokes(&[(Key::W, true)], true);
        assert_eq!(keyboard.strokes(&[], false), Strokes::default());
    }

    #[test]
    fn without_a_window_manager_keys_work_too() {
        let mut keyboard = Keyboard::default();
        keyboard.strokes(&[(Key::W, true)], false);
        assert_eq!(keyboard.strokes(&[], false).held, [Key::W]);
    }

    #[test]
    fn each_key_has_its_own_movement() {
        let all = [Key::W, Key::S, Key::A, Key::D, Key::E, Key::Q, Key::Left, Key::Right, Key::Up, Key::Down];
        let mut seen: Vec<Held> = all.iter().map(|&key| held(&[key])).collect();
        assert!(seen.iter().all(|&one| one != Held::default()));
        seen.dedup();
        assert_eq!(seen.len(), all.len());
        assert_eq!(held(&[Key::X, Key::Space]), Held::default());
    }

    #[test]
    fn only_a_pressed_mouse_drags() {
        let mut mouse = Mouse::default();
        assert_eq!(mouse.drag(Some((10.0, 10.0)), false, 100), (0.0, 0.0));
        assert_eq!(mouse.drag(Some((50.0, 50.0)), true, 100), (0.0, 0.0), "where the drag begins");
        assert_eq!(mouse.drag(Some((75.0, 40.0)), true, 100), (0.25, -0.1));
        assert_eq!(mouse.drag(Some((0.0, 0.0)), false, 100), (0.0, 0.0));
        assert_eq!(mouse.drag(Some((0.0, 0.0)), true, 100), (0.0, 0.0));
        assert!(mouse.drag(Some((5.0, 5.0)), true, 0).0.is_finite());
    }
}
