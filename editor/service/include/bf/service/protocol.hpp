// What the page and the service say to each other: JSON-RPC 2.0 in text frames over one WebSocket, samples in
// binary frames. editor/page/src/protocol.ts is made from these declarations.
//
// The address is ws://127.0.0.1:PORT/socket?token=TOKEN, with port and token of the address that `bf edit`
// prints; a browser must come from that address. A request is {"jsonrpc": "2.0", "id": 1, "method": "hello",
// "params": {"protocol": 5}}, with all or some members of its parameters. The answer has the same id and a
// `result`, or an `error` with a `message` for people and a `code`: -32000 the request is refused, -32602 its
// parameters are wrong, -32601 there is no such method, -32600 and -32700 it is no request. A notification
// has a method, parameters and no id; it goes to all pages.
//
// A binary frame has one piece per sample, little-endian: uint32 index of the signal, uint32 index of the
// branch, uint32 number of elements n, float64 time [s], n float64. Samples of a branch before it begins are
// those of the branch that it comes from. They may come in any order of time, and several times.
// Index 2^31 + i is world i of the scene: x y z qw qx qy qz of each body, x y z of a point and of the force
// of the floor there for each foot (zeros where it does not touch), and x y z of the centre of mass; in m and
// N, world axes. The meshes of a world come by HTTP from /meshes/SCENE/WORLD?token=TOKEN, each as uint32
// number of vertices v, uint32 number of triangles t, 3v float32 positions, 3v float32 normals, 3t uint32
// vertices.
#pragma once

#include "bf/model/model.hpp"
#include "bf/service/cockpit.hpp"
#include "bf/service/scene.hpp"
#include "bf/view/drawing.hpp"

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace bf::service {

/// A page of another number is refused.
inline constexpr int protocol_version = 5;

/// One mistake, with the text of `bf check`.
struct Diagnostic {
    std::string file; ///< relative to the opened folder
    int line = 0, column = 0;
    std::string path, message, remedy;
    std::vector<model::Fix> fixes = {};
    bool is_open = false; ///< a port that has no wire yet
};

/// A panel in which runs are watched: a plot of the model's own, or what its layout has.
struct PanelInfo {
    std::string name;
    model::Shows shows = model::Shows::lines;
    std::vector<std::string> signals = {}; ///< paths
    bool is_kept = false;                  ///< stands in the layout
};

/// Of the opened model, after each change.
struct DocumentState {
    std::string file;          ///< relative to the opened folder
    std::int64_t revision = 0; ///< counts changes, whoever made them
    bool can_undo = false, can_redo = false;
    bool is_checked = false; ///< are `diagnostics` those of this revision?
    bool is_saved = true;    ///< is it on the disk?
    std::vector<Diagnostic> diagnostics = {};
    std::string failure = {};   ///< why files and page differ: a file cannot be read, or not be written
    std::string collision = {}; ///< which edit does not fit what another program wrote at the same time
    std::vector<PanelInfo> panels = {};
    std::vector<std::string> plots = {}; ///< titles of the model's own
};
struct LibraryPort {
    std::string name, doc;
};
struct LibraryBlock {
    std::string name, group, doc;
    std::vector<LibraryPort> inputs = {}, outputs = {}; ///< with default arguments
};

enum class FieldRole {
    argument,  ///< fixed when the block is made
    parameter, ///< may change in a run
    property   ///< of the document: period, doc, when, ...
};

/// What a dialog shows of one setting of a block, or of the model.
struct SettingField {
    std::string name;
    FieldRole role = FieldRole::argument;
    std::optional<std::string> text = {}; ///< as the document has it, where it has
    std::string initial = {};             ///< what holds without it
    std::string value = {};               ///< what the expression comes to, where that is known
    std::string unit = {}, doc = {};      ///< with limits
    std::vector<std::string> choices = {};
    std::vector<std::string> names = {}; ///< of the choices, besides which other values may be given
    std::optional<double> least = {}, greatest = {}; ///< of each element
    bool is_whole = false;                           ///< may elements be whole numbers alone?
};

struct Inspection {
    std::string path, title, type, doc;
    std::vector<SettingField> fields = {};
};

/// All parameters of the model: what each block, subsystem and the model itself (no path) has.
struct Parameters {
    std::vector<Inspection> blocks;
};

struct Evaluate {
    std::string path, name; ///< of a setting, which is not changed
    std::string text;       ///< that it would have
};
struct Evaluated {
    std::string value = {}, error = {}; ///< both empty where a text is no expression
};

struct VariableField {
    std::string system; ///< path of the subsystem that declares it
    std::string name;   ///< "Gain.Kp": a field of a struct
    std::string text, value, unit, doc, limits;
    std::optional<std::string> minimum = {}, above = {}, maximum = {}; ///< as the document has them
    std::optional<double> least = {}, greatest = {};                   ///< what they come to
    std::string mistake = {};                                          ///< what is wrong with its value
    std::vector<std::string> used_by = {}; ///< what names it: paths of blocks, subsystems and variables
};

enum class Running { none, paused, running, ended, failed };

/// What was simulated from one change or edit on.
struct BranchInfo {
    int index = 0;
    int parent = -1;        ///< the branch that it comes from; -1: it begins at 0
    double from = 0;        ///< where it leaves that one, s
    double reached = 0;     ///< latest time that was simulated, s
    std::string cause = {}; ///< "Gain.Kp = 0.2", "edit"; of a branch from 0: nothing
};

/// An edit that waits, since what it would lose is said before.
struct RunEdit {
    std::string refusal = {};              ///< why the edited model cannot go on from here
    std::vector<std::string> lost = {};    ///< states that it cannot take over, with the reason
    std::vector<std::string> begun = {};   ///< its states that begin with their initial values
    std::vector<std::string> unclear = {}; ///< whose states these are, and what is taken for true
};

/// A value of a parameter ("controller.pd.K") or of a variable ("Gain.Kp").
struct Tune {
    std::string name;
    std::vector<double> values;
};

struct RunState {
    Running state = Running::none;
    double time = 0;                   ///< s; of the samples that are shown: as `bf run --record` has them
    double step = 0;                   ///< s, between instants; 0: nothing runs, or another program's run
    std::optional<double> stop = {};   ///< s; none: the model names none
    std::optional<double> factor = {}; ///< seconds of the model per second; none: as fast as possible
    double reached = 0;                ///< latest time that was simulated on this branch, s
    bool is_current = true;            ///< is it a run of the model as it is now?
    std::string message = {};          ///< why it failed, or how the run of another program ended
    int branch = 0;                    ///< the one that is shown and goes on
    std::vector<BranchInfo> branches = {}; ///< in the order in which they began; the oldest are forgotten
    std::optional<RunEdit> edit = {};
    std::optional<LiveProgram> live = {};
    std::vector<Tune> tuned = {}; ///< what the run has otherwise than the model as it is now
    std::string recorded = {};    ///< why this is what was recorded, and nothing runs; empty: it is a run
};

/// What a value of a signal means to people.
struct NamedValue {
    double value = 0;
    std::string name;
};

/// A signal of the run. Its index is that of binary frames.
struct SignalInfo {
    int index = 0;
    std::string path;
    int elements = 0;
    std::vector<std::string> names = {}; ///< of its elements, where they have some
    std::string unit = {};
    int rows = 1;                        ///< its elements come column by column
    bool is_continuous = false;          ///< does it go on between samples, rather than keep its value?
    std::vector<NamedValue> values = {}; ///< that have names
};

// ---- parameters and results of methods ----

struct Nothing {};
struct Hello {
    int protocol = 0;
};
struct Welcome {
    std::string version;            ///< of BlockFactory
    std::vector<std::string> files; ///< models of the opened folder, relative to it
    int page = 0;                   ///< number of this page
    DocumentState document;
    RunState run = {}; ///< that another page may have started
    std::optional<LiveReport> live = {};
};
struct Open {
    std::string file; ///< relative to the opened folder
};
struct LibraryList {
    std::vector<LibraryBlock> blocks;
};

enum class Show { sizes, types, rates, units };
struct Moved {
    std::string path; ///< of a block or port; the name of a note
    editor::Point to;
    std::optional<editor::Point> size = {}; ///< of a block; none: as it is
};
struct Bent {
    std::string path; ///< of the input that the wire leads to
    std::vector<editor::Point> points;
};
struct Draw {
    std::string system;
    std::vector<Show> show = {};
    std::vector<Moved> moved = {}, moved_notes = {}; ///< as if they stood there, while they are dragged
    std::vector<Bent> bent = {};
    bool marks_open = false; ///< are ports without a wire marked as mistakes?
};
/// What differs from an earlier model, and a subsystem of both, side by side.
struct Compare {
    std::string file;   ///< relative to the opened folder; empty: the model in the last commit of git
    std::string system; ///< in the opened model, or else in the earlier one
};
struct Difference {
    std::string path, system; ///< as in model::Distinction
    std::string text;         ///< "~ controller.pd: setting K: 2 -> 3"
};
struct ModelComparison {
    std::vector<Difference> differences;
    editor::Drawing drawing;
};
struct Inspect {
    std::string path; ///< of a block; empty: the model itself
};
/// An operation on the document in its own form, {"do": "rename", ...}; see bf/model/operation.hpp.
struct OperationText {
    std::string json;
};
struct BlockType {
    std::string type;
};
struct Edit {
    OperationText operation;
};
struct InSystem {
    std::string system;
};
struct Find {
    std::string text; ///< in any letter case
};
/// Where it stands: in a name, a type, a setting, a variable or a text.
struct Hit {
    std::string path; ///< of the block or subsystem
    std::string what, text;
};
struct Hits {
    std::vector<Hit> hits; ///< the first 200
};
struct Variables {
    std::vector<VariableField> variables; ///< that expressions of the subsystem see, its own first
};
struct Copy {
    std::string system;
    std::vector<std::string> names; ///< of its blocks
};
struct Text {
    std::string text;
};
/// The lines in which a block, an own port or a wire stands.
struct TextPlace {
    std::string system, path;           ///< as in drawings
    std::string from = {};              ///< of a wire, as in drawings
    int line = 0, column = 0, last = 0; ///< it begins there, and ends in the last line; from 1
};
/// The file in which a subsystem stands.
struct FileText {
    std::string file, text;
    std::vector<TextPlace> places = {}; ///< from the beginning to the end, what stands around another first
    std::vector<Diagnostic> diagnostics = {}; ///< of what another program wrote and is no model
};
struct Rewrite {
    std::string file, text;
    std::string before; ///< that the file held for whoever changed it
};
/// A text that is no model, or not of what the file holds now, is not taken.
struct Rewritten {
    DocumentState document;
    bool is_outdated = false;
    std::vector<Diagnostic> diagnostics = {};
};
struct Paste {
    std::string system, text;
    editor::Point at; ///< of their upper left corner
};

enum class Action {
    start, ///< from the beginning, or on from where it is
    pause,
    step, ///< a base step
    stop,
    to, ///< forwards by simulating, back by a checkpoint
    pace,
    until,  ///< on to an event, or to the end
    branch, ///< the run goes on on another one
    adopt,  ///< the edit that waits
    /// Of a run of another program, as its start, if it waits to be started, and its stop in order: see
    /// bf::realtime::Control.
    emergency_stop
};
struct RunCommand {
    Action action = Action::start;
    std::optional<double> time = {};   ///< of `to`, s
    std::optional<double> factor = {}; ///< of `start`, `pace` and `until`, as in RunState
    std::optional<int> branch = {};
    /// Of `until`: "controller.x > 0.3", as for `bf run --until`; a signal alone: until it changes.
    std::string event = {};
};
/// What the model plots: a title and paths of signals.
struct PlotPanel {
    std::string title;
    std::vector<std::string> signals;
};
struct Signals {
    std::vector<SignalInfo> signals;
    std::vector<PlotPanel> plots = {};
    std::vector<std::string> unknown = {}; ///< paths that were asked for, and are no signals of the run
};
struct Watch {
    std::vector<std::string> paths; ///< all that this page wants to have samples of
    std::vector<int> branches = {}; ///< of these, besides the one that is shown
};
/// A span of the run, of which a page looks at more than it has samples of.
struct Refine {
    double from = 0, to = 0; ///< s; both the same: the values at an instant
};
struct RecordingNumber {
    int number = 0;
};
/// What has been read of a recording of the opened folder.
struct Recorded {
    int number = 0; ///< its samples come by HTTP from /recordings/NUMBER/INDEX?token=TOKEN, as a binary frame
    std::string file;
    std::vector<SignalInfo> signals = {};
    std::string defect = {};  ///< what is wrong with the file, which is readable up to there
    double end = 0;           ///< of its latest sample, s
    std::string failure = {}; ///< why it has nothing
};
struct FileList {
    std::vector<std::string> files; ///< relative to the opened folder, images to the file of a subsystem
};
enum class Language { cpp, c };
struct Generate {
    Language language = Language::cpp;
};
struct TextFile {
    std::string name, text;
};
/// Lines that a block became; from 1.
struct CodePlace {
    std::string path, file;
    int first = 0, last = 0;
};
/// What `bf generate` writes of the model as it is now, without the headers that all models share.
struct GeneratedCode {
    std::vector<TextFile> files; ///< that with the most blocks first
    std::vector<CodePlace> places;
};
/// What a block took of the run since this is asked for.
struct BlockTime {
    std::string path; ///< of a block, or of what is not one block
    double seconds = 0;
    std::int64_t calls = 0;
};
struct Times {
    std::vector<BlockTime> blocks; ///< slowest first
};
struct Look {
    bool is_wanted = true; ///< does this page get the poses, or the times?
};

} // namespace bf::service
