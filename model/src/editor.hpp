#pragma once

#include "bf/base/names.hpp"
#include "bf/model/edit.hpp"
#include "bf/model/operation.hpp"
#include "chart.hpp"
#include "nested_chart.hpp"

#include <algorithm>
#include <functional>

/// How operations change a model, which is a copy that is thrown away when one refuses.
namespace bf::model {

/// What check() says of what is no name.
inline constexpr const char* name_rule =
    "a name has 1 to 200 bytes, no '.' or '*', no control character and no blank at its ends";

template <typename Items> auto named(Items& items, std::string_view name) {
    return std::ranges::find_if(items, [&](const auto& item) { return item.name == name; });
}

template <typename Items> std::vector<std::string> names_of(const Items& items) {
    std::vector<std::string> names;
    for (const auto& item : items) names.push_back(item.name);
    return names;
}

/// A text in the same spelling as the reader gives it.
inline std::string without_last_breaks(std::string text) {
    text.erase(text.find_last_not_of('\n') + 1);
    return text;
}

/// What Set may change of a state or a transition of the block's chart.
std::vector<Property> chart_properties(const Block& block, const std::string& name);

/// A key of blocks of all kinds, which is no setting of theirs.
inline bool is_of_every_block(std::string_view name) {
    return name == "doc" || name == "when" || name == "period" || name == "offset";
}

class Editor {
  public:
    explicit Editor(Model& model) : model_(model) {}

    void operator()(const operations::Add& add);
    void operator()(const operations::Remove& remove);
    void operator()(const operations::Rename& rename);
    void operator()(const operations::Reorder& reorder);
    void operator()(const operations::Connect& connect);
    void operator()(const operations::Disconnect& disconnect);
    void operator()(const operations::NameSignal& named);
    void operator()(const operations::Set& set);
    void operator()(const operations::AddPort& add);
    void operator()(const operations::SetVariable& set);
    void operator()(const operations::RenameVariable& rename);
    void operator()(const operations::Move& move);
    void operator()(const operations::Resize& resize);
    void operator()(const operations::Flip& flip);
    void operator()(const operations::Rotate& rotate);
    void operator()(const operations::PlacePort& place);
    void operator()(const operations::Bend& bend);
    void operator()(const operations::Label& label);
    void operator()(const operations::Annotate& annotate);
    void operator()(const operations::Group& group);
    void operator()(const operations::Dissolve& dissolve);
    void operator()(const operations::Inline& inlined);
    void operator()(const operations::Extract& extract);
    void operator()(const operations::Record& record);
    void operator()(const operations::Plot& plot);
    void operator()(const operations::Watch& watch);
    void operator()(const operations::Patch& patch);
    void operator()(const operations::Batch& batch);

  private:
    struct Own {
        System& system;     // with the block or port
        std::string parent; // path of it
        std::string name;   // of the block or port
        Block* block;       // null: a port
        bool is_output;
    };

    [[noreturn]] void refuse(const Location& where, const std::string& path, std::string message,
                             std::string remedy) const;

    System& system_at(std::string_view path);
    Own find_own(std::string_view path);
    Block& block_at(std::string_view path);

    /// The path of a named signal of a subsystem: that one, and the subsystem; else null.
    std::pair<System*, NamedSignal*> named_signal(const std::string& path);

    /// Refuses a name that is none, or taken by a block, port or named signal of the system.
    void require_free(const System& system, const std::string& path, const std::string& name,
                      const char* kind) const;

    /// Refuses the name of a key that blocks have besides their settings.
    void require_setting(const std::string& name, const Location& where, const std::string& path,
                         const std::string& remedy) const;

    /// The end of a connection that is written `text`; what the system does not have is refused by check().
    static Endpoint endpoint(const System& system, const std::string& text);

    /// One more destination of `from`, in the connection that it has, if it has one.
    static void add_wire(System& system, const Endpoint& from, Endpoint to);

    /// Changes each path of signals and layout by `change`, which gives the new paths: none removes it.
    void follow(const std::function<std::vector<std::string>(const std::string&)>& change);
    void move_paths(const std::string& from, const std::string& to);

    /// Where the field that a dotted name ends with stands, and its name there. Its first field makes a
    /// struct.
    std::pair<std::vector<Variable>*, std::string> place_of(std::vector<Variable>& variables,
                                                            const std::string& name, const std::string& path,
                                                            bool is_made) const;
    /// Takes a variable or a field away; a struct without fields is none.
    static void remove_variable(std::vector<Variable>& variables, const std::string& name);
    /// A variable that the system declares, or the value that a block gives to one of its file (null: not
    /// read).
    void set_parameter(const operations::Set& set, const Location& where, const System* declaring,
                       std::vector<Variable>& values, bool is_own);

    Placement& placement(const std::string& path);
    void require_port(const std::string& path, const std::string& port);
    /// Refuses where no wire or transition leads to `path`.
    void require_wire(const std::string& path);
    /// Corners of a wire, or labels, as `operation` asks for; neither: it finds its way.
    void draw_wire(Bends drawn, const char* operation);
    /// The sides of ports follow the name of one of a subsystem's; empty: it is gone.
    void rename_side(const std::string& path, const std::string& port, const std::string& name);

    // Of the chart of a state machine, whose states are drawn as blocks and whose transitions as wires.
    bool is_chart(const std::string& path) const;
    /// The machine around a path whose chart has states in states, or that itself, and the rest of the path.
    std::optional<std::pair<std::string, std::string>> nested_at(const std::string& path) const;
    /// Says where that chart refuses what `action` does with the machine.
    void on_nested(const std::string& machine, const std::function<void(Block&)>& action);
    void edit_nested(const std::string& machine, const std::function<void(NestedChart&)>& change);
    ChartEditor chart_at(const std::string& path);
    std::size_t state_of(const ChartEditor& editor, const std::string& path, const std::string& name) const;
    [[noreturn]] void refuse_transition(const ChartEditor& editor, const std::string& path,
                                        const std::string& name) const;
    void require_free_state(const ChartEditor& editor, const std::string& path,
                            const std::string& name) const;
    void add_state(const operations::Add& add);
    void remove_state(const std::string& machine, const std::string& name);
    void rename_state(const std::string& machine, const std::string& name, const std::string& to);
    void connect_states(const operations::Connect& connect);
    void disconnect_states(const operations::Disconnect& disconnect);
    void set_in_chart(const std::string& machine, const std::string& name, const operations::Set& set);
    /// What is drawn of states and transitions follows their names.
    void follow_chart(const std::string& machine, const Renamed& renamed);

    Model& model_;
};

} // namespace bf::model
