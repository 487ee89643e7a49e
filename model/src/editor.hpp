#pragma once

#include "bf/model/edit.hpp"
#include "bf/model/operation.hpp"

/// How operations change a model, which is a copy that is thrown away when one refuses.
namespace bf::model {

/// What follows `prefix` in `path`: "" or ".rest"; nothing if `path` is not it nor under it.
std::optional<std::string> rest_under(std::string_view path, std::string_view prefix);

class Editor {
  public:
    explicit Editor(Model& model) : model_(model) {}

    void operator()(const operations::Add& add);
    void operator()(const operations::Remove& remove);
    void operator()(const operations::Rename& rename);
    void operator()(const operations::Reorder& reorder);
    void operator()(const operations::Connect& connect);
    void operator()(const operations::Disconnect& disconnect);
    void operator()(const operations::Set& set);
    void operator()(const operations::AddPort& add);
    void operator()(const operations::SetVariable& set);
    void operator()(const operations::RenameVariable& rename);
    void operator()(const operations::Move& move);
    void operator()(const operations::Resize& resize);
    void operator()(const operations::Flip& flip);
    void operator()(const operations::Bend& bend);
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

    /// Refuses a name that is none, or taken by a block or port of the system.
    void require_free(const System& system, const std::string& path, const std::string& name,
                      const char* kind) const;

    /// The end of a connection that is written `text`; what the system does not have is refused by check().
    static Endpoint endpoint(const System& system, const std::string& text);

    /// One more destination of `from`, in the connection that it has, if it has one.
    static void add_wire(System& system, const Endpoint& from, Endpoint to);

    /// Changes each path of signals and layout by `change`, which gives the new paths: none removes it.
    void follow(const std::function<std::vector<std::string>(const std::string&)>& change);
    void move_paths(const std::string& from, const std::string& to);

    Placement& placement(const std::string& path);

    Model& model_;
};

} // namespace bf::model
