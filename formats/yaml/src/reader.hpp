// From the syntax tree of one file to a Model.
#pragma once

#include "comments.hpp"
#include "keys.hpp"
#include "node.hpp"

#include "bf/model/model.hpp"

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <unordered_set>
#include <utility>
#include <vector>

namespace bf::formats {

/// Turns the syntax tree of one file into a Model.
class Reader {
  public:
    /// Gives the model of another file that a block at a place and with a path refers to; null if it is
    /// unreadable or wrong.
    using Load = std::function<std::shared_ptr<model::Model>(
        const std::string& file, const model::Location& where, const std::string& block)>;

    /// Without `load` references are not read.
    explicit Reader(const Source& source, Load load = {}) : source_(source), load_(std::move(load)) {}

    std::vector<model::Diagnostic> wrong;
    std::vector<LineRange> values; ///< that stand on several lines

    model::Model read_model(const Node& node);
    std::vector<model::Variable> read_variables(const Node& map, const std::string& path,
                                                bool are_declared = false);
    std::vector<model::Variable> read_enumerations(const Node& map, const std::string& path);

  private:
    using OnEntry = std::function<void(const Node& key, const Node& value)>;

    model::Location at(const Node& node) const { return source_.at(node.line, node.column); }
    std::vector<model::Location> at(const std::vector<Node>& items) const;
    std::vector<model::Location> at(const std::vector<std::string_view>& parts) const;
    std::vector<model::Location> rows_of_text(const Node& value) const;
    void report(const Node& node, const std::string& path, std::string message, std::string remedy) {
        wrong.push_back({at(node), path, std::move(message), std::move(remedy)});
    }

    void read_entries(const Node& map, const std::string& path, const std::string& what,
                      const OnEntry& on_entry);
    void report_unknown(const Node& key, const std::string& path, const std::string& of,
                        const keys::Keys& known);

    std::string read_text(const Node& key, const Node& value, const std::string& path);
    std::size_t read_choice(const Node& key, const Node& value, const std::string& path,
                            const keys::Keys& choices);
    static bool is_mapping_setting(const Node& block, const Node& key);
    model::Expression read_mapping(const Node& key, const Node& value, const std::string& path);
    model::Expression read_expression(const Node& key, const Node& value, const std::string& path);
    bool is_cell(const Node& map) const;
    model::Expression read_flow(const Node& value, const std::string& path);
    model::Expression read_rows(const Node& key, const Node& value, const std::string& path);

    void read_declared(model::Variable& variable, const Node& map, const std::string& path);
    std::vector<model::Port> read_ports(const Node& key, const Node& value, const std::string& path,
                                        const keys::Keys& known);
    void read_port(model::Port& port, const Node& map, const std::string& path, const keys::Keys& known);
    std::vector<model::Block> read_blocks(const Node& map, const std::string& path);
    model::Block read_block(const Node& key, const Node& map, const std::string& path);
    /// What needs all blocks: `connections` and `signals`; null: there are none.
    struct Ends {
        const Node *connections = nullptr, *signals = nullptr;
    };
    bool read_system_key(model::System& system, Ends& ends, const Node& key, const Node& value,
                         const std::string& path);
    void read_ends(model::System& system, const Ends& ends, const std::string& path);
    std::optional<model::Endpoint> read_endpoint(const Node& node, const std::string& path,
                                                 const std::unordered_set<std::string>& blocks);
    template <typename Item>
    std::vector<Item> read_list(const Node& key, const Node& value, std::string Item::*member);
    double read_number(const Node& key, const Node& value);
    bool read_extent(model::Point& at, std::optional<model::Point>& size, const Node& key, const Node& value);
    std::vector<model::Point> read_points(const Node& key, const Node& value);
    model::Layout read_layout(const Node& map);

    const Source& source_;
    Load load_;
};

} // namespace bf::formats
