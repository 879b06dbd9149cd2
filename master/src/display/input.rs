//! Keyboard and mouse of the window, and their meaning for camera, overlay and workers.

use std::cell::RefCell;
use std::rc::Rc;
use std::time::Instant;

use glam::DVec3;
use minifb::{InputCallback, Key, MouseButton, MouseMode, Window};
use raw_window_handle::{HasWindowHandle, RawWindowHandle};

use crate::viewer::InputAction;

/// Keys that were pressed (`true`) or released, in order, since the last update.
type Edges = Rc<RefCell<Vec<(Key, bool)>>>;

/// Keys that magnify the picture: the plus sign is on the key of the equals sign, or on the keypad.
const MAGNIFY: [Key; 3] = [Key::Equal, Key::NumPadPlus, Key::PageUp];

/// Keys that do the reverse.
const REDUCE: [Key; 3] = [Key::Minus, Key::NumPadMinus, Key::PageDown];

/// Receiver of every key, also of one that is pressed and released between two updates; minifb's list of pressed keys misses
/// those.
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
    updated_at: Instant,
}

/// Input since the last update.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct InputEvents {
    /// Actions on the camera.
    pub(super) camera: Vec<InputAction>,
    /// H: shows or hides the list of keys.
    pub(super) toggle_help: bool,
    /// O: shows or hides the figures.
    pub(super) toggle_figures: bool,
    /// F: shows or hides the panel of workers.
    pub(super) toggle_accounts: bool,
    /// Presses of C: colours rows in the next way.
    pub(super) next_coloring: usize,
    /// Presses of Tab: selects the next worker.
    pub(super) select_next: usize,
    /// P: pauses or resumes workers.
    pub(super) toggle_pause: bool,
    /// L: drains the selected worker.
    pub(super) drain: bool,
    /// K: kicks the selected worker.
    pub(super) kick: bool,
    /// B: admits kicked workers again.
    pub(super) bring_back: bool,
    /// Esc: ends the viewer.
    pub(super) quit: bool,
    /// Whether a key was down or the mouse has moved.
    pub(super) any: bool,
}

impl InputEvents {
    /// Whether any of them concerns workers.
    pub(super) fn concerns_workers(&self) -> bool {
        let Self { toggle_accounts, select_next, toggle_pause, drain, kick, bring_back, .. } = *self;
        toggle_accounts || select_next > 0 || toggle_pause || drain || kick || bring_back
    }
}

impl Controls {
    /// Receives the input of `window` from now on.
    pub(super) fn of(window: &mut Window) -> Self {
        let edges = Edges::default();
        window.set_input_callback(Box::new(Listener(Rc::clone(&edges))));
        let system = window.window_handle().map(|handle| handle.as_raw());
        Self {
            edges,
            keyboard: Keyboard::default(),
            mouse: Mouse::default(),
            notches_per_unit: system.map_or(1.0, notches_per_unit),
            updated_at: Instant::now(),
        }
    }

    /// Input since the last call; once per update of the window.
    pub(super) fn update(&mut self, window: &mut Window) -> InputEvents {
        let edges = std::mem::take(&mut *self.edges.borrow_mut());
        let strokes = self.keyboard.strokes(&edges, window.is_active());
        let at = window.get_unscaled_mouse_pos(MouseMode::Pass);
        let pressed = window.get_mouse_down(MouseButton::Left);
        let drag = self.mouse.drag(at, pressed, window.get_size().1);
        let wheel =
            window.get_scroll_wheel().map_or(0.0, |(_, units)| f64::from(units) * self.notches_per_unit);
        let moved = self.mouse.moved(window.get_unscaled_mouse_pos(MouseMode::Discard));
        let seconds = self.updated_at.elapsed().as_secs_f64();
        self.updated_at = Instant::now();
        InputEvents {
            any: moved || pressed || wheel != 0.0 || !strokes.held.is_empty(),
            camera: camera_actions(&strokes, drag, wheel, seconds),
            toggle_help: strokes.toggled(Key::H),
            toggle_figures: strokes.toggled(Key::O),
            toggle_accounts: strokes.toggled(Key::F),
            next_coloring: strokes.count(Key::C),
            select_next: strokes.count(Key::Tab),
            toggle_pause: strokes.toggled(Key::P),
            drain: strokes.pressed.contains(&Key::L),
            kick: strokes.pressed.contains(&Key::K),
            bring_back: strokes.pressed.contains(&Key::B),
            quit: strokes.pressed.contains(&Key::Escape),
        }
    }
}

/// Actions on the camera: R resets it, W A S D E Q move it, arrows turn it, comma and period roll it, plus and minus (or Page
/// Up and Page Down, which are on every keyboard) magnify its picture, a drag orbits, the wheel zooms. `drag` is in heights of the
/// window, to the right and downwards.
fn camera_actions(strokes: &Strokes, drag: (f64, f64), wheel: f64, seconds: f64) -> Vec<InputAction> {
    let mut actions = Vec::new();
    if strokes.pressed.contains(&Key::R) {
        actions.push(InputAction::ResetCamera);
    }
    let axis = |positive, negative| {
        let is_held = |key| i8::from(strokes.held.contains(&key));
        f64::from(is_held(positive) - is_held(negative))
    };
    let direction = DVec3::new(axis(Key::D, Key::A), axis(Key::E, Key::Q), axis(Key::W, Key::S));
    if direction != DVec3::ZERO {
        actions.push(InputAction::Move { direction, seconds });
    }
    let (right, up) = (axis(Key::Right, Key::Left), axis(Key::Up, Key::Down));
    if (right, up) != (0.0, 0.0) {
        actions.push(InputAction::Look { right, up, seconds });
    }
    let roll = axis(Key::Period, Key::Comma);
    if roll != 0.0 {
        actions.push(InputAction::Roll { right: roll, seconds });
    }
    let is_any_held = |keys: &[Key]| i8::from(keys.iter().any(|key| strokes.held.contains(key)));
    let inwards = f64::from(is_any_held(&MAGNIFY) - is_any_held(&REDUCE));
    if inwards != 0.0 {
        actions.push(InputAction::Magnify { inwards, seconds });
    }
    if drag != (0.0, 0.0) {
        actions.push(InputAction::Orbit { right: drag.0, down: drag.1 });
    }
    if wheel != 0.0 {
        actions.push(InputAction::Zoom { notches: wheel });
    }
    actions
}

/// Notches per unit of the wheel, away from the user. minifb passes on the units of each window system: a notch is 1 on X
/// and macOS, 12 on Windows and -10 on Wayland (its axis points downwards, and compositors count ten to fifteen units).
fn notches_per_unit(system: RawWindowHandle) -> f64 {
    match system {
        RawWindowHandle::Wayland(_) => -1.0 / 10.0,
        RawWindowHandle::Win32(_) => 1.0 / 12.0,
        _ => 1.0,
    }
}

/// Keys that are down.
#[derive(Debug, Default)]
struct Keyboard {
    down: Vec<Key>,
    was_active: bool,
}

/// Keys of one update.
#[derive(Debug, Default, PartialEq)]
struct Strokes {
    /// Down at any moment since the last update.
    held: Vec<Key>,
    /// Pressed since the last update, once per press.
    pressed: Vec<Key>,
}

impl Strokes {
    /// Whether a switch of this key has changed: two presses cancel out.
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
            // The release of a held key goes to the window that has the keyboard now.
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
                // A held key repeats; a key that was down when the window opened is released.
                (true, Some(_)) | (false, None) => {}
            }
        }
        strokes
    }
}

/// Last position of the mouse, and of a drag.
#[derive(Debug, Default)]
struct Mouse {
    at: Option<(f32, f32)>,
    dragged_from: Option<(f32, f32)>,
}

impl Mouse {
    /// Whether the mouse has moved since the last update.
    fn moved(&mut self, at: Option<(f32, f32)>) -> bool {
        std::mem::replace(&mut self.at, at) != at
    }

    /// Movement of the pressed mouse since the last update, to the right and downwards, in heights of the window.
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
    fn a_tap_between_two_updates_counts() {
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
    fn a_window_that_loses_the_keyboard_releases_all_keys() {
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
        let moves = [Key::W, Key::S, Key::A, Key::D, Key::E, Key::Q];
        let turns = [Key::Left, Key::Right, Key::Up, Key::Down, Key::Comma, Key::Period];
        let all = [&moves[..], &turns, &[Key::PageUp, Key::PageDown]].concat();
        let actions = |keys: &[Key]| {
            let strokes = Strokes { held: keys.to_vec(), pressed: Vec::new() };
            camera_actions(&strokes, (0.0, 0.0), 0.0, 0.01)
        };
        let seen: Vec<Vec<InputAction>> = all.iter().map(|&key| actions(&[key])).collect();
        for (index, one) in seen.iter().enumerate() {
            assert_eq!(one.len(), 1);
            assert!(!seen[..index].contains(one), "{one:?}");
        }
        assert_eq!(actions(&[Key::X, Key::Space]), []);
        assert_eq!(actions(&[Key::W, Key::S]), [], "opposite keys cancel out");
        assert_eq!(actions(&[Key::Equal, Key::NumPadMinus]), [], "opposite keys cancel out");
        assert_eq!(actions(&MAGNIFY), actions(&[Key::NumPadPlus]), "keys of one action do not add up");
        assert_eq!(actions(&[Key::Minus])[0], InputAction::Magnify { inwards: -1.0, seconds: 0.01 });
        assert_eq!(actions(&[Key::Period])[0], InputAction::Roll { right: 1.0, seconds: 0.01 });
        assert_eq!(actions(&[Key::W])[0], InputAction::Move { direction: DVec3::Z, seconds: 0.01 });
    }

    #[test]
    fn all_actions_of_one_update_keep_their_order() {
        let strokes = Strokes { held: vec![Key::Left, Key::W], pressed: vec![Key::R] };
        let actions = camera_actions(&strokes, (0.25, -0.1), -2.0, 0.01);
        assert_eq!(
            actions,
            [
                InputAction::ResetCamera,
                InputAction::Move { direction: DVec3::Z, seconds: 0.01 },
                InputAction::Look { right: -1.0, up: 0.0, seconds: 0.01 },
                InputAction::Orbit { right: 0.25, down: -0.1 },
                InputAction::Zoom { notches: -2.0 },
            ]
        );
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
