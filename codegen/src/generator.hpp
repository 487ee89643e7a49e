// One generation: gives every quantity its place in a structure, then prints.
#pragma once

#include "bf/codegen/generate.hpp"

#include "names.hpp"

#include <set>
#include <vector>

namespace bf::codegen {

/// Where a quantity lies in the generated class: empty member for one without elements.
struct Place {
    std::string structure; ///< "signals", "parameters", ...
    std::string member;
    std::string text() const { return structure + "." + member; }
};

/// A member of a structure.
struct Field {
    Node::End end;
    std::string member, path;
    const Slot* slot;
};

/// Statements that run under one guard.
struct Guarded {
    int rate = 1, condition = 0;
    std::vector<std::string> statements;
};

class Generator {
  public:
    Generator(const Diagram& diagram, const Options& options);
    Files run();

  private:
    const Block& block(int node) const { return *diagram_.nodes[static_cast<std::size_t>(node)].block; }
    const DiagramNode& node(int n) const { return diagram_.nodes[static_cast<std::size_t>(n)]; }

    void check() const;
    void place_all();
    void place(const Node::End& end, const char* structure, std::vector<Field>& fields,
               const std::string& path);
    const Place& place_of(const Node::End& end) const;

    /// One statement per rule, with its constants before it.
    std::string rule(int n, const Call& call);
    std::string operand(int n, const Call::Reference& from, std::string& constants);
    std::string condition_test(int c) const;
    /// Statements that write literal numbers, or the values of another quantity.
    std::string write_values(const std::string& target, const Slot& slot,
                             const std::vector<double>& values) const;
    std::string initial_output(const Condition::Outlet& outlet) const;
    std::vector<std::string> resets(int n, bool only_from_parameters) const;

    std::vector<Guarded> outputs(bool constant);
    std::vector<Guarded> updates();
    std::vector<Guarded> commits() const;

    /// Spreads guarded statements over functions `family_1`, ... and returns the calls of all.
    std::string functions(const std::string& family, const std::vector<Guarded>& all);
    std::string guard(const Guarded& g) const;

    std::string structure(const char* name, const char* doc, const std::vector<Field>& fields,
                          bool has_values) const;
    std::string header() const;
    std::string main_source(const std::string& constants, const std::string& outputs,
                            const std::string& updates);
    std::string tables() const;
    std::string table_row(const std::string& name, const Node::End& end) const;
    std::string readme() const;

    const Diagram& diagram_;
    Options options_;
    std::string class_, file_;
    std::vector<std::vector<Place>> places_; ///< by node and slot
    std::vector<std::vector<Place>> next_;   ///< of discrete states
    std::vector<Field> inputs_, parameters_, signals_, states_, workspace_;
    std::vector<Field> outputs_; ///< copies; end = what is copied
    std::set<std::string> taken_inputs_, taken_parameters_, taken_signals_, taken_states_, taken_workspace_;
    std::set<std::string> headers_;
    std::vector<std::string> declarations_; ///< of the functions that pieces became
    std::vector<std::string> pieces_;       ///< their definitions
    std::vector<int> piece_statements_;
};

} // namespace bf::codegen
