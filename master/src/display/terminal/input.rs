//! Keys and mouse of the terminal, and their meaning for camera, panel and workers: as in the window.
//!
//! A terminal reports presses and no releases, and repeats a held key. So each report moves the camera for a fixed time.

use crossterm::event::{
    Event, KeyCode, KeyEvent, KeyEventKind, KeyModifiers, MouseButton, MouseEvent, MouseEventKind,
};
use glam::DVec3;

use crate::viewer::InputAction;

/// Time for which one report of a key moves the camera, in seconds: terminals repeat some thirty times a second, after a pause.
const STEP: f64 = 1.0 / 20.0;

/// Meaning of one event.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Meaning {
    /// An action of the camera.
    Camera(InputAction),
    /// H: shows or hides the list of keys.
    ToggleHelp,
    /// O: shows or hides the panel.
    ToggleFigures,
    /// P: pauses or resumes all workers.
    TogglePause,
    /// B: admits kicked workers again.
    BringBack,
    /// Another size of the terminal, or a request to draw it again.
    Redraw,
    /// Ctrl-Z.
    Stop,
    /// Esc or Ctrl-C.
    Quit,
}

/// Reader of events; it remembers where a drag is.
#[derive(Debug, Default)]
pub(super) struct Reader {
    dragged_from: Option<(u16, u16)>,
}

impl Reader {
    /// The meaning of an event, if it has one. `rows`: rows of the terminal.
    pub(super) fn meaning(&mut self, event: &Event, rows: u16) -> Option<Meaning> {
        match event {
            Event::Key(key) if key.kind != KeyEventKind::Release => of_key(*key),
            Event::Mouse(mouse) => self.of_mouse(*mouse, rows).map(Meaning::Camera),
            Event::Resize(..) | Event::FocusGained => Some(Meaning::Redraw),
            _ => None,
        }
    }

    fn of_mouse(&mut self, mouse: MouseEvent, rows: u16) -> Option<InputAction> {
        let at = (mouse.column, mouse.row);
        match mouse.kind {
            MouseEventKind::Down(MouseButton::Left) => {
                self.dragged_from = Some(at);
                None
            }
            MouseEventKind::Up(_) => {
                self.dragged_from = None;
                None
            }
            MouseEventKind::Drag(MouseButton::Left) => {
                let from = self.dragged_from.replace(at)?;
                let moved = |to: u16, from: u16| f64::from(i32::from(to) - i32::from(from));
                // A cell is half as wide as high.
                let height = f64::from(rows.max(1));
                Some(InputAction::Orbit {
                    right: moved(at.0, from.0) / 2.0 / height,
                    down: moved(at.1, from.1) / height,
                })
            }
            MouseEventKind::ScrollUp => Some(InputAction::Zoom { notches: 1.0 }),
            MouseEventKind::ScrollDown => Some(InputAction::Zoom { notches: -1.0 }),
            _ => None,
        }
    }
}

fn of_key(key: KeyEvent) -> Option<Meaning> {
    if key.modifiers.contains(KeyModifiers::CONTROL) {
        return match key.code {
            KeyCode::Char('c') => Some(Meaning::Quit),
            KeyCode::Char('z') => Some(Meaning::Stop),
            KeyCode::Char('l') => Some(Meaning::Redraw),
            _ => None,
        };
    }
    let shift = if key.modifiers.contains(KeyModifiers::SHIFT) { 2.0 } else { 1.0 };
    let seconds = STEP * shift;
    let fly = |x, y, z| InputAction::Move { direction: DVec3::new(x, y, z), seconds };
    let look = |right, up| InputAction::Look { right, up, seconds };
    let action = match key.code {
        KeyCode::Char(letter) => match letter.to_ascii_lowercase() {
            'd' => fly(1.0, 0.0, 0.0),
            'a' => fly(-1.0, 0.0, 0.0),
            'e' => fly(0.0, 1.0, 0.0),
            'q' => fly(0.0, -1.0, 0.0),
            'w' => fly(0.0, 0.0, 1.0),
            's' => fly(0.0, 0.0, -1.0),
            '.' => InputAction::Roll { right: 1.0, seconds },
            ',' => InputAction::Roll { right: -1.0, seconds },
            '+' | '=' => InputAction::Magnify { inwards: 1.0, seconds },
            '-' => InputAction::Magnify { inwards: -1.0, seconds },
            'r' => InputAction::ResetCamera,
            'h' => return Some(Meaning::ToggleHelp),
            'o' => return Some(Meaning::ToggleFigures),
            'p' => return Some(Meaning::TogglePause),
            'b' => return Some(Meaning::BringBack),
            _ => return None,
        },
        KeyCode::Right => look(1.0, 0.0),
        KeyCode::Left => look(-1.0, 0.0),
        KeyCode::Up => look(0.0, 1.0),
        KeyCode::Down => look(0.0, -1.0),
        KeyCode::PageUp => InputAction::Magnify { inwards: 1.0, seconds },
        KeyCode::PageDown => InputAction::Magnify { inwards: -1.0, seconds },
        KeyCode::Esc => return Some(Meaning::Quit),
        _ => return None,
    };
    Some(Meaning::Camera(action))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn key(code: KeyCode, modifiers: KeyModifiers) -> Option<Meaning> {
        Reader::default().meaning(&Event::Key(KeyEvent::new(code, modifiers)), 30)
    }

    fn mouse(reader: &mut Reader, kind: MouseEventKind, column: u16, row: u16) -> Option<Meaning> {
        let event = MouseEvent { kind, column, row, modifiers: KeyModifiers::NONE };
        reader.meaning(&Event::Mouse(event), 30)
    }

    #[test]
    fn each_key_has_its_own_meaning() {
        let codes = "wasdeq,.+-rhopb".chars().map(KeyCode::Char);
        let others = [KeyCode::Left, KeyCode::Right, KeyCode::Up, KeyCode::Down, KeyCode::Esc];
        let seen: Vec<Meaning> =
            codes.chain(others).map(|code| key(code, KeyModifiers::NONE).unwrap()).collect();
        for (index, one) in seen.iter().enumerate() {
            assert!(!seen[..index].contains(one), "{one:?}");
        }
        assert_eq!(key(KeyCode::Char('x'), KeyModifiers::NONE), None);
        assert_eq!(key(KeyCode::Char('c'), KeyModifiers::CONTROL), Some(Meaning::Quit));
        assert_eq!(key(KeyCode::Char('z'), KeyModifiers::CONTROL), Some(Meaning::Stop));
    }

    #[test]
    fn a_drag_orbits_by_its_length_and_needs_a_button() {
        let mut reader = Reader::default();
        let drag = MouseEventKind::Drag(MouseButton::Left);
        assert_eq!(mouse(&mut reader, drag, 10, 10), None, "it began outside");
        assert_eq!(mouse(&mut reader, MouseEventKind::Down(MouseButton::Left), 10, 10), None);
        let orbit = mouse(&mut reader, drag, 40, 7);
        assert_eq!(orbit, Some(Meaning::Camera(InputAction::Orbit { right: 0.5, down: -0.1 })));
        assert_eq!(mouse(&mut reader, MouseEventKind::Up(MouseButton::Left), 40, 7), None);
        assert_eq!(mouse(&mut reader, drag, 50, 7), None);
        let wheel = mouse(&mut reader, MouseEventKind::ScrollDown, 0, 0);
        assert_eq!(wheel, Some(Meaning::Camera(InputAction::Zoom { notches: -1.0 })));
    }
}
