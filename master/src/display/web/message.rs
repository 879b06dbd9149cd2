//! Messages of clients: input of the camera, commands, acknowledgements. Everything in them is bounded.

use glam::DVec3;
use serde::Deserialize;

use crate::viewer::InputAction;

/// Largest message of a client, in bytes (4 KiB).
pub(super) const MAX_MESSAGE_BYTES: usize = 4 << 10;
/// Most movements in one message.
const MAX_MOVES: usize = 16;
/// Longest time of one movement, in seconds.
const MAX_SECONDS: f64 = 0.25;
/// Longest drag in one message, in heights of the picture.
const MAX_DRAG: f64 = 4.0;
/// Most notches of a wheel in one message.
const MAX_NOTCHES: f64 = 10.0;

/// A message of a client.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(tag = "type", rename_all = "lowercase", deny_unknown_fields)]
pub(super) enum ClientMessage {
    /// A picture is on the screen: the next one may follow.
    Shown {
        /// Number of the picture.
        picture: u32,
    },
    /// Movements of the camera, in order.
    Input { moves: Vec<Move> },
    /// A control command; its reply has the same number.
    Command { id: u32, line: String },
    /// A request to steer.
    Steer,
    /// Accepts or refuses the request of another client.
    HandOver { grant: bool },
    /// Whether the page can be seen.
    Visible { visible: bool },
}

/// One movement of the camera: see [`InputAction`] for meanings and units.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub(super) enum Move {
    /// Right, up, forward, seconds.
    Fly(f64, f64, f64, f64),
    /// Right, up, seconds.
    Look(f64, f64, f64),
    /// Right, down, in heights of the picture.
    Orbit(f64, f64),
    /// Right, seconds.
    Roll(f64, f64),
    /// Inwards, seconds.
    Magnify(f64, f64),
    /// Notches of a wheel.
    Zoom(f64),
    /// Restores the camera of the scene.
    Reset,
}

impl ClientMessage {
    /// Reads a message.
    ///
    /// # Errors
    /// The mistake in the text.
    pub(super) fn parse(text: &str) -> Result<Self, String> {
        let message = serde_json::from_str(text).map_err(|error| format!("not a message: {error}"))?;
        match &message {
            Self::Input { moves } if moves.len() > MAX_MOVES => {
                Err(format!("{} movements are too many for one message: at most {MAX_MOVES}", moves.len()))
            }
            _ => Ok(message),
        }
    }
}

impl Move {
    /// The action of the movement. Its numbers are clamped to the limits of this module; JSON numbers are finite.
    pub(super) fn action(self) -> InputAction {
        let unit = |value: f64| value.clamp(-1.0, 1.0);
        let time = |seconds: f64| seconds.clamp(0.0, MAX_SECONDS);
        let drag = |heights: f64| heights.clamp(-MAX_DRAG, MAX_DRAG);
        match self {
            Self::Fly(x, y, z, seconds) => {
                InputAction::Move { direction: DVec3::new(unit(x), unit(y), unit(z)), seconds: time(seconds) }
            }
            Self::Look(right, up, seconds) => {
                InputAction::Look { right: unit(right), up: unit(up), seconds: time(seconds) }
            }
            Self::Orbit(right, down) => InputAction::Orbit { right: drag(right), down: drag(down) },
            Self::Roll(right, seconds) => InputAction::Roll { right: unit(right), seconds: time(seconds) },
            Self::Magnify(inwards, seconds) => {
                InputAction::Magnify { inwards: unit(inwards), seconds: time(seconds) }
            }
            Self::Zoom(notches) => InputAction::Zoom { notches: notches.clamp(-MAX_NOTCHES, MAX_NOTCHES) },
            Self::Reset => InputAction::ResetCamera,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn messages_are_read_and_nothing_else_is() {
        let read = |text| ClientMessage::parse(text).unwrap();
        assert_eq!(read(r#"{"type":"shown","picture":7}"#), ClientMessage::Shown { picture: 7 });
        assert_eq!(read(r#"{"type":"steer"}"#), ClientMessage::Steer);
        let moves =
            vec![Move::Orbit(0.5, -0.25), Move::Fly(0.0, 0.0, 1.0, 0.02), Move::Zoom(1.0), Move::Reset];
        let text =
            r#"{"type":"input","moves":[{"orbit":[0.5,-0.25]},{"fly":[0,0,1,0.02]},{"zoom":1},"reset"]}"#;
        assert_eq!(read(text), ClientMessage::Input { moves });
        let many = format!(r#"{{"type":"input","moves":[{}"reset"]}}"#, r#""reset","#.repeat(MAX_MOVES));
        let wrong = [
            "",
            "[]",
            "{}",
            r#"{"type":"quit"}"#,
            r#"{"type":"shown"}"#,
            r#"{"type":"shown","picture":-1}"#,
            r#"{"type":"input","moves":[{"orbit":[1]}]}"#,
            r#"{"type":"input","moves":[{"zoom":1e999}]}"#,
            r#"{"type":"command","id":1,"line":"help","more":1}"#,
            &many,
        ];
        for text in wrong {
            assert!(ClientMessage::parse(text).is_err(), "{text}");
        }
    }

    #[test]
    fn movements_are_bounded() {
        let direction = DVec3::new(1.0, -1.0, 0.5);
        let fly = Move::Fly(9.0, -9.0, 0.5, 60.0).action();
        assert_eq!(fly, InputAction::Move { direction, seconds: MAX_SECONDS });
        assert_eq!(Move::Zoom(-1e9).action(), InputAction::Zoom { notches: -MAX_NOTCHES });
        assert_eq!(Move::Orbit(1e9, -1e9).action(), InputAction::Orbit { right: MAX_DRAG, down: -MAX_DRAG });
        assert_eq!(
            Move::Look(0.0, 2.0, -1.0).action(),
            InputAction::Look { right: 0.0, up: 1.0, seconds: 0.0 }
        );
        assert_eq!(Move::Roll(-3.0, 0.1).action(), InputAction::Roll { right: -1.0, seconds: 0.1 });
        assert_eq!(Move::Magnify(0.5, 0.1).action(), InputAction::Magnify { inwards: 0.5, seconds: 0.1 });
    }
}
