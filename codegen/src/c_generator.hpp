// A generation in plain C11: the same places and statements, printed for compilers without templates.
#pragma once

#include "c_chart.hpp"
#include "c_language.hpp"
#include "generator.hpp"

#include <functional>
#include <set>
#include <string>

namespace bf::codegen {

class CGenerator final : public Generator {
  public:
    CGenerator(const Diagram& diagram, const Options& options);
    Files run() override;

  private:
    void check() const override;
    std::string in_structure(const std::string& name) const override;
    Argument argument(int n, const Call::Reference& from) override;
    std::string rule(int n, Phase phase, int index) override;
    std::string write_values(const std::string& target, const Slot& slot,
                             const std::vector<double>& values) const override;
    std::string assignment(const std::string& to, const Slot& to_slot, const std::string& from,
                           const Slot& from_slot) const override;
    std::string failing(int node, const std::string& why) const override;
    std::string unless_failed() const override {
        return "    if (model->failure != NULL) {\n        return false;\n    }\n";
    }
    std::string rate_functions() const override;
    std::string time_at(const std::string& steps) const override;
    std::string unless(const std::string& good, const std::string& otherwise) const override;
    std::string has_crossed(const Field& guard) const override;
    std::string is_positive(const Node::End& end) const override;
    std::string text_of(const program::Statement& statement, program::Pass pass) override;
    std::string commits(const program::Statement& statement) const override;
    std::string call_of(const std::string& function) const override;
    std::string declaration_of(const std::string& function) const override;
    std::string head_of(const std::string& function) const override;

    /// A statement for the elements of a quantity, which writes [i], or nothing behind a number.
    std::string each(const Slot& slot, const std::function<std::string(const std::string&)>& statement) const;
    std::string is_finite(const Node::End& end) const;
    std::string edge(const program::Statement& statement) const;
    std::string repetition(const program::Statement& statement, program::Pass pass);
    std::string runge_kutta(const Calls& calls) const;
    std::string crossings(const Calls& calls);
    /// A function of the model that is an expression.
    std::string evaluation(const std::string& name, const std::string& its, const std::string& doc) const;
    std::string member(const Field& field) const;
    /// The typedef of a structure and, if it has members, that of a member of the model.
    std::string structure(const std::string& name, const std::string& doc, const std::vector<Field>& fields);
    std::string control_members() const;
    std::string header();
    std::string source(const Calls& calls);
    std::string main_program() const;
    std::string make_file() const;
    std::string read_me() const;

    std::set<CFunction> functions_;
    CCharts charts_;
    std::vector<std::string> refused_; ///< rules that are more than arithmetic
    int c_loop_depth_ = 0;
};

} // namespace bf::codegen
