//! The displays of one run of `view`.

use std::path::Path;
use std::thread;

use crate::app::cli::{DisplayArgs, DisplayKind, FarmArgs};
use crate::app::control::Console;
use crate::display::{Display, DisplayError, SceneInfo, WindowDisplay};
use crate::error::CommandError;
use crate::viewer::{InputAction, ViewerHandle};

/// A display that runs on a thread of its own until its user quits or the viewer ends.
type RunDisplay = Box<dyn FnOnce(ViewerHandle) -> Result<(), DisplayError> + Send>;

/// Open displays of a view, in the order of the command line: the first one decides the size of the picture.
pub(super) struct OpenDisplays {
    displays: Vec<OpenDisplay>,
}

/// An open display.
enum OpenDisplay {
    /// The window, which must run on the main thread.
    Window(Box<WindowDisplay>),
    /// Any other display, with its name.
    #[cfg_attr(not(feature = "terminal"), allow(dead_code, reason = "the terminal is the only one"))]
    Other(&'static str, RunDisplay),
    /// Web pages, which send control commands as well.
    #[cfg(feature = "web")]
    Web(Box<crate::display::web::WebDisplay>),
}

impl OpenDisplays {
    /// Checks that this build has the displays, before a scene is compiled.
    ///
    /// # Errors
    /// A display that this build does not have.
    pub(super) fn check_build(args: &DisplayArgs, scene: &Path) -> Result<(), CommandError> {
        for kind in args.kinds() {
            match kind {
                DisplayKind::Window => {
                    WindowDisplay::check_build().map_err(|problem| no_window(&problem, scene))?;
                }
                #[cfg(feature = "terminal")]
                DisplayKind::Terminal => {}
                #[cfg(feature = "web")]
                DisplayKind::Web => {}
            }
        }
        Ok(())
    }

    /// Opens the displays.
    ///
    /// # Errors
    /// A display that cannot be opened, with the reason and the alternatives.
    pub(super) fn open(
        args: &DisplayArgs,
        farm: &FarmArgs,
        info: &SceneInfo,
        (width, height): (u32, u32),
        scene: &Path,
    ) -> Result<Self, CommandError> {
        #[cfg(not(feature = "web"))]
        let _ = farm;
        let open = |kind: &DisplayKind| match kind {
            DisplayKind::Window => WindowDisplay::open(info.clone(), width, height)
                .map(|window| OpenDisplay::Window(Box::new(window)))
                .map_err(|problem| no_window(&problem, scene)),
            #[cfg(feature = "terminal")]
            DisplayKind::Terminal => terminal(args),
            #[cfg(feature = "web")]
            DisplayKind::Web => web(args, farm, info),
        };
        let displays = args.kinds().iter().map(open).collect::<Result<_, _>>()?;
        Ok(Self { displays })
    }

    /// Runs all displays until one of them ends, and then ends the others. Blocks the calling thread, which must be the main
    /// thread where there is a window. `console` executes control commands of displays that have them.
    ///
    /// # Errors
    /// The first display that cannot go on.
    pub(super) fn run(self, first: ViewerHandle, console: &Console) -> Result<(), DisplayError> {
        #[cfg(not(feature = "web"))]
        let _ = console;
        let mut window = None;
        let mut threads = Vec::new();
        let mut unused = Some(first.clone());
        for display in self.displays {
            let handle = unused.take().unwrap_or_else(|| first.further_display());
            let (name, run): (_, RunDisplay) = match display {
                OpenDisplay::Window(display) => {
                    window = Some((display, handle));
                    continue;
                }
                OpenDisplay::Other(name, run) => (name, run),
                #[cfg(feature = "web")]
                OpenDisplay::Web(display) => {
                    let console = console.clone();
                    let display =
                        display.with_commands(std::sync::Arc::new(move |line| console.execute(line)));
                    ("web", Box::new(move |viewer| display.run(viewer)))
                }
            };
            let end = first.clone();
            let run = move || {
                let result = run(handle);
                // The viewer may have ended already.
                end.send(vec![InputAction::Quit]);
                result
            };
            let spawned = thread::Builder::new().name(name.to_owned()).spawn(run);
            let failed = |error| DisplayError::Failed(format!("no thread for the {name} display: {error}"));
            threads.push(spawned.map_err(failed)?);
        }
        // The viewer ends when the last handle is dropped.
        drop(first);
        let shown = window.map_or(Ok(()), |(display, handle)| display.run(handle));
        threads.into_iter().fold(shown, |result, thread| {
            let ended = thread.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic));
            result.and(ended)
        })
    }
}

/// Opens the terminal.
#[cfg(feature = "terminal")]
fn terminal(args: &DisplayArgs) -> Result<OpenDisplay, CommandError> {
    use crate::app::cli::Cells;
    use crate::display::terminal::{CellChoice, CellKind, Protocol, TerminalDisplay};

    let choice = args.cells.map(|cells| match cells {
        Cells::Half => CellChoice::Cells(CellKind::Half),
        Cells::Quadrant => CellChoice::Cells(CellKind::Quadrant),
        Cells::Sextant => CellChoice::Cells(CellKind::Sextant),
        Cells::Octant => CellChoice::Cells(CellKind::Octant),
        Cells::Kitty => CellChoice::Graphics(Protocol::Kitty),
        Cells::Iterm => CellChoice::Graphics(Protocol::Iterm),
        Cells::Sixel => CellChoice::Graphics(Protocol::Sixel),
    });
    let display = TerminalDisplay::open(choice).map_err(|problem| {
        CommandError::Failed(format!("cannot show the view in the terminal: {problem}"))
    })?;
    Ok(OpenDisplay::Other("terminal", Box::new(move |viewer| display.run(viewer))))
}

/// Listens for web browsers.
#[cfg(feature = "web")]
fn web(args: &DisplayArgs, farm: &FarmArgs, info: &SceneInfo) -> Result<OpenDisplay, CommandError> {
    use crate::display::web::WebDisplay;

    let address = args.web_address();
    let security = crate::app::trust::web_security(farm, address)?;
    let display = WebDisplay::open(address, security, info.clone()).map_err(CommandError::WrongInput)?;
    Ok(OpenDisplay::Web(Box::new(display)))
}

/// Reports that there is no window, with the command that needs none.
fn no_window(problem: &str, scene: &Path) -> CommandError {
    CommandError::Failed(format!(
        "cannot open a window: {problem}; without a display, run: rayfarm-master view {scene} --display terminal or \
         --display web, or rayfarm-master render {scene} -o picture.png",
        scene = scene.display()
    ))
}
