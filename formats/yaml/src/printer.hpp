#pragma once

#include "base.hpp"

namespace bf::formats {

/// Writes items: those that the text of before has as it has them, as far as they have not changed, and all
/// others in the canonical form.
class Printer {
  public:
    explicit Printer(Base* base = nullptr) : base_(base) {}

    std::string text;

    void print(const Item& item, int indent, Entry* parent = nullptr);
    void print_lines(const std::vector<std::string>& lines, int indent);

    /// The entries of a mapping or sequence on lines, after its items: those that mean nothing.
    void print_rest(const Entry& entry, int shift);

  private:
    void print_edited(const Item& item, Entry& entry, int indent);
    void print_value(const Item& item, int indent); ///< what follows the key, in the canonical form
    void print_scalar(std::string_view scalar, std::size_t column, const std::string& trailing);
    void print_literal(std::string_view lines, int indent);
    void end_line(const std::string& trailing);
    void add_shifted(std::string_view lines, int shift);

    /// The text of an entry from `begin` on, where its value is a matrix or a list and becomes another one;
    /// nothing if only a new one can stand there.
    std::optional<std::string> rows_edited(const Content& content, const Entry& entry, std::size_t begin);

    /// The new text of a collection in brackets; nothing if it cannot stand there.
    std::optional<std::string> flow_edited(const Content& content, Entry& entry);
    std::optional<std::string> flow_item(const Item& item, Entry* entry);

    Base* base_;
};

/// The text that `model.source` becomes, in which only what changed is different; nothing if that cannot be
/// read back as the model.
std::optional<std::string> edited_yaml(const model::Model& model);

/// Reads a model without the files that it refers to; nothing if something is wrong with it. `source` has its
/// text, `root` becomes its syntax.
std::optional<model::Model> read_alone(const Source& source, Node& root);

} // namespace bf::formats
