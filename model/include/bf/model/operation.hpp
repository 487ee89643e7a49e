#pragma once

#include "bf/model/model.hpp"

#include <functional>
#include <map>
#include <variant>

/// Changes of a model. Each is a value with a text form (JSON), each has an inverse, and each leaves the
/// model as it was where it is impossible. Whatever refers to what is renamed, moved or removed follows:
/// connections, recorded and plotted signals, layout.
///
/// `path` is the dotted path of a block (`controller.pd`) or of a subsystem's own input or output
/// (`controller.tau`); `system` is that of a subsystem in this document, empty for the model itself. Ends of
/// connections are written as in the file: `pd.u`, `pd` (its only port), `tau` (an own port).
namespace bf::model {

/// A part of the model takes another value. `at` is its path through the members and lists
/// (`root/blocks/2/name`); of a list, `removed` items from there on make room for those of `value`. Values
/// are JSON.
struct Change {
    std::string at;
    std::optional<std::size_t> removed = {};
    std::string value;
};

/// A block or subsystem, with all under it, or a state of a chart got another path.
struct Moved {
    std::string from, to;
};

/// The path, before all of these moves at once, of what stands at `path` after them, and the other way round;
/// none: nothing stood there.
std::optional<std::string> path_before(const std::vector<Moved>& moves, const std::string& path);
std::optional<std::string> path_after(const std::vector<Moved>& moves, const std::string& path);

namespace operations {

/// A new block, at its place in the order (else last) and in the drawing.
struct Add {
    std::string system;
    Block block;
    std::optional<std::size_t> index = {};
    std::optional<Point> at = {};
};

/// Removes a block or a port, its wires, and the signals under it from records and plots; or the name of a
/// signal.
struct Remove {
    std::string path;
};

/// Renames a block, a port of a subsystem or a named signal. Patterns (`p*.y`) stay as they are.
struct Rename {
    std::string path, name;
};

/// Another place in the order of the blocks or ports.
struct Reorder {
    std::string path;
    std::size_t index = 0;
};

struct Connect {
    std::string system, from, to;
};

/// Removes the wire to `to`, or the one from `from` where a variant's input has several.
struct Disconnect {
    std::string system;
    std::string from = {};
    std::string to;
};

/// Names the signal that comes from there. A name that the subsystem has already is that of this signal from
/// now on.
struct NameSignal {
    std::string system, from, name;
};

/// A setting of a library's block, its type as `block`, a parameter of a subsystem (the value of one of its
/// variables; in a file of its own, what the block gives to it `with`), or what else the document says by
/// that name: `period`, `doc`, `file` of a block, `execution`, `reset`, `icon` of a subsystem, `shape`,
/// `unit` of a port, `step`, `solver` of the model (no path). No value: as if it were not written.
struct Set {
    std::string path, name;
    std::optional<std::string> value = {};
};

/// A new input or output of a subsystem.
struct AddPort {
    std::string system;
    Port port;
    bool is_output = false;
    std::optional<std::size_t> index = {};
};

/// Declares a variable or a field of a struct, `Gain.Kp` (last, if it is new), or removes it. The first field
/// declares the struct, and the last one takes it along.
struct SetVariable {
    std::string system, name;
    std::optional<Variable> variable = {};
};

/// Renames a variable or an enumeration and the expressions that use it, in its subsystem and below.
struct RenameVariable {
    std::string system, name, to;
};

/// Draws a block or a port at another point.
struct Move {
    std::string path;
    Point to;
};

/// Gives a drawn block a size, or leaves it to the editor.
struct Resize {
    std::string path;
    std::optional<Point> size = {};
};

/// Mirrors a drawn block, so that its inputs come from the other side.
struct Flip {
    std::string path;
};

/// Turns a drawn block by a quarter clockwise.
struct Rotate {
    std::string path;
};

/// The side of a drawn block on which one of its ports stands; none: as it is by itself.
struct PlacePort {
    std::string path, port;
    std::optional<Side> side = {};
};

/// The corners of the wire to the input at `path`; none: it finds its way.
struct Bend {
    std::string path;
    std::vector<Point> points = {};
};

/// Labels at the source and at the end of the wire to the input at `path`, instead of the wire; or the wire,
/// which then finds its way.
struct Label {
    std::string path;
    bool is_there = false;
};

/// Writes or removes a note. Its own name, if any, is the new one; without a size it keeps the one it has.
struct Annotate {
    std::string name;
    std::optional<Note> note = {};
};

/// Puts blocks into a new virtual subsystem, which stands where the first of them stood. A port appears for
/// each source outside and for each inside that is used outside.
struct Group {
    std::string system;
    std::vector<std::string> blocks;
    std::string name;
};

/// Puts the content of a virtual subsystem in its place. A name that is taken outside gets the subsystem's
/// in front.
struct Dissolve {
    std::string path;
};

/// Puts the content of the referenced file in its place.
struct Inline {
    std::string path;
};

/// Puts the content of a subsystem into a model of its own, which still sees the variables around it; writing
/// `find(model, path)->reference->model` to `file` is up to the caller.
struct Extract {
    std::string path, file;
};

/// Records a signal (or a pattern of signals), or no longer; with the title of one, in that panel of the
/// plot. A panel begins with its first signal and goes with its last one.
struct Record {
    std::string path;
    bool is_recorded = true;
    std::string plot = {};
};

/// A panel of the plot, or none of that title.
struct Plot {
    std::string title;
    std::optional<std::vector<std::string>> signals = {};
};

/// A panel in which runs are watched, or none of that name. Its own name, if it has one, is the new name.
struct Watch {
    std::string name;
    std::optional<Display> display = {};
};

/// The exact inverse of an operation, and its inverse again.
struct Patch {
    std::vector<Change> changes;
    std::vector<Moved> moved =
        {}; ///< blocks that keep what they are, of which the changes tell the values alone
    std::map<std::string, std::shared_ptr<const Model>> files =
        {}; ///< referenced models; not in the text form
};

struct Batch;

} // namespace operations

using Operation =
    std::variant<operations::Add, operations::Remove, operations::Rename, operations::Reorder,
                 operations::Connect, operations::Disconnect, operations::NameSignal, operations::Set,
                 operations::AddPort, operations::SetVariable, operations::RenameVariable, operations::Move,
                 operations::Resize, operations::Flip, operations::Rotate, operations::PlacePort,
                 operations::Bend, operations::Label, operations::Annotate, operations::Group,
                 operations::Dissolve, operations::Inline, operations::Extract, operations::Record,
                 operations::Plot, operations::Watch, operations::Patch, operations::Batch>;

namespace operations {

/// Several in a row, all or none.
struct Batch {
    std::vector<Operation> operations;
};

} // namespace operations

/// The model in a file that a block refers to, the path being as written; null where it is not to be had.
using ReadReference = std::function<std::shared_ptr<const Model>(const std::string& file)>;

/// Changes `model` and returns the inverse: applied to the result it gives a model that is equal to the one
/// before, down to comments and places. Throws Errors, each with a place, and changes nothing where the
/// operation is impossible or would break the model. Without `read`, files that the model does not refer to
/// yet stay unread.
operations::Patch edit(Model& model, const Operation& operation, const ReadReference& read = {});

/// Something that Set may change by that name; of a library's block that has not its settings.
struct Property {
    std::string name;
    std::optional<std::string> value = {}; ///< as the document has it, where it has
    std::vector<std::string> choices = {};
};

/// Of a block, a subsystem's own port, or, without a path, the model: what acts there as it is executed, and
/// what the document gives. A model without ports of its own is no subsystem of another one. Throws Errors
/// where nothing stands at `path`.
std::vector<Property> properties(const Model& model, const std::string& path);

/// What turns `before` into `after`, every detail included, but that blocks of both are the same ones.
operations::Patch difference(const Model& before, const Model& after);

/// `{"do": "rename", "path": "controller.pd", "name": "law"}`. Members that have their usual value are left
/// out; an expression is its MATLAB text.
std::string to_json(const Operation& operation);

/// Throws Errors on text that is no operation.
Operation operation_from_json(std::string_view text);

/// What has been done to a model, to be undone and done again.
class History {
  public:
    /// False if nothing is other than it was: there is nothing to undo, and what was undone can be redone.
    bool edit(Model& model, const Operation& operation, const ReadReference& read = {});
    /// Another model takes its place, such as one that was read anew because another program wrote its file.
    void replace(Model& model, Model other);

    /// False if there is nothing to undo (redo).
    bool undo(Model& model) { return step(model, done_, undone_); }
    bool redo(Model& model) { return step(model, undone_, done_); }
    bool can_undo() const { return !done_.empty(); }
    bool can_redo() const { return !undone_.empty(); }

    /// What the last change moved; none: another model took the place, and it is not known which of its
    /// blocks were there before.
    const std::optional<std::vector<Moved>>& moved() const { return moved_; }

  private:
    using Step = std::variant<operations::Patch, Model>; // the way back from where the model is
    bool step(Model& model, std::vector<Step>& from, std::vector<Step>& to);

    std::vector<Step> done_, undone_;
    std::optional<std::vector<Moved>> moved_;
};

} // namespace bf::model
