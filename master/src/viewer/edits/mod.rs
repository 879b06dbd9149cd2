//! Changes of the scene while it is shown.
//!
//! An edit changes the text of the scene file, not the loaded scene: comments remain, the loader checks every value and
//! explains mistakes as it does in files, undoing a change restores the former text, and saving writes the current one.
//!
//! ```text
//!   syntax      a line of text to an edit
//!   edit        the edits
//!   document    the tables of a scene file, found by name or number
//!   apply       an edit to a changed document: text in, text out
//!   transform   movements, turns and scales of objects of each kind
//!   history     texts to undo and to redo
//!   files       names of files in a scene that is saved elsewhere
//!   editor      the text, history and loader of one scene
//!   service     the editor on a thread of its own, which also watches the files
//! ```

mod apply;
mod document;
mod edit;
mod editor;
mod files;
mod history;
mod service;
mod syntax;
#[cfg(test)]
mod tests;
mod transform;

pub(crate) use edit::EditCommand;
pub(crate) use editor::SceneEditor;
pub(crate) use service::EditorHandle;
