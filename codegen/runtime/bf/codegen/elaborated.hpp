// The model behind a program whose sizes are known at its start: elaborated then, from the text that the
// program was generated from and the values of a parameter file. Its context holds all memory of the
// generated class.
#pragma once

#include "bf/base/text_file.hpp"
#include "bf/codegen/blocks_in_context.hpp"
#include "bf/codegen/dynamic.hpp"
#include "bf/codegen/quantity.hpp"

#include "bf/core/registry.hpp"
#include "bf/elaborate/elaborate.hpp"
#include "bf/elaborate/structure.hpp"
#include "bf/elaborate/tuning.hpp"
#include "bf/formats/yaml.hpp"
#include "bf/program/program.hpp"

#include <algorithm>
#include <cstddef>
#include <deque>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <memory>
#include <set>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

namespace bf::generated {

class ElaboratedModel final : public BlocksInContext {
  public:
    /// A file of the model, relative to its folder.
    struct Text {
        const char* file;
        const char* content;
    };
    /// The first text is the model's own. Throws what elaboration throws, and std::runtime_error naming the
    /// first part whose structure is another one than `structure`.
    ElaboratedModel(void (*add_libraries)(Registry&), const std::string& folder,
                    const std::vector<Text>& texts, std::vector<ElaborateOptions::Override> overrides,
                    const std::vector<std::pair<const char*, std::uint64_t>>& structure) {
        add_libraries(registry_);
        const auto at = std::filesystem::absolute(folder);
        formats::Files files;
        for (const Text& text : texts) files[(at / text.file).lexically_normal()] = text.content;
        const auto model = formats::read_yaml((at / texts.front().file).lexically_normal(), files);
        diagram_ = elaborate(model, registry_, {std::move(overrides), at.lexically_normal().string()});
        const auto parts = structure_of(diagram_);
        for (std::size_t i = 0; i < std::max(parts.size(), structure.size()); ++i) {
            if (i < parts.size() && i < structure.size() && parts[i].name == structure[i].first &&
                parts[i].hash == structure[i].second)
                continue;
            throw std::runtime_error("'" +
                                     (i < parts.size() ? parts[i].name : std::string(structure[i].first)) +
                                     "' has another structure than the code was generated for; with these "
                                     "values, generate it again");
        }
        own_context_ =
            std::make_unique<Context>(diagram_.context_nodes(), static_cast<int>(diagram_.rates.size()));
        context_ = own_context_.get();
        for (std::size_t r = 0; r < diagram_.rates.size(); ++r)
            periods_.push_back(diagram_.rates[r].is_continuous ? 0 : diagram_.period(static_cast<int>(r)));
        sets_ = program::lower(diagram_).sets;
        tuning_ = std::make_unique<Tuning>(diagram_);
        make_tables();
    }
    ~ElaboratedModel() override { stop(); }

    // ---- the memory of the generated class

    template <class T> void bind(Dynamic<T>& member, int node, int slot) {
        set(member, context_->data(node, slot), node, slot);
    }
    template <class T> void bind_next(Dynamic<T>& member, int node, int slot) {
        set(member, context_->next_data(node, slot), node, slot);
    }
    /// Outputs have memory of their own: the solver computes signals anew inside the step.
    template <class T> void bind_output(Dynamic<T>& member, int node, int slot) {
        const auto count = static_cast<std::size_t>(diagram_.slot({node, slot}).size.count());
        set(member, outputs_.emplace_back(count * sizeof(T)).data(), node, slot);
    }
    template <class T> void bind_rate(Dynamic<T>& member, int node, int slot) {
        set(member, context_->frame(node).rate[slot], node, slot);
    }
    double* continuous() { return context_->continuous_state().data(); }
    double* rates() { return context_->continuous_rate().data(); }
    int continuous_size() { return static_cast<int>(context_->continuous_state().size()); }

    /// The constants of a rule's operand.
    kernels::View<const double> constants(int node, Phase phase, int rule, int operand) const {
        const auto& rules = diagram_.nodes[static_cast<std::size_t>(node)].block->declaration().rules(phase);
        const auto& values =
            *rules[static_cast<std::size_t>(rule)].operands[static_cast<std::size_t>(operand)].constants;
        return {values.data(), static_cast<int>(values.size())};
    }
    double stop_time() const { return diagram_.stop; }
    using BlocksInContext::add_task;
    void set(int number) noexcept override {
        const auto& [quantity, source, values] = sets_[static_cast<std::size_t>(number)];
        context_->set(quantity, source, values);
    }

    // ---- the run

    void prepare() noexcept override {
        BlocksInContext::prepare();
        const auto rates = context_->continuous_rate();
        std::fill(rates.begin(), rates.end(), 0.0);
        for (auto& output : outputs_) std::fill(output.begin(), output.end(), std::byte{0});
        for (int n = 0; n < count(); ++n) {
            const auto& slots = diagram_.nodes[static_cast<std::size_t>(n)].block->resolution().slots;
            for (std::size_t s = 0; s < slots.size(); ++s)
                if (slots[s].role == Role::output && !is_input({n, static_cast<int>(s)}))
                    write_values(context_->data(n, static_cast<int>(s)), slots[s].type, slots[s].size.count(),
                                 {});
        }
    }

    // ---- names

    /// The parameter or variable of that name, or null.
    const Quantity* find_parameter(const char* name) const noexcept {
        const Quantity* const found = parameters().find(name);
        return found ? found : variables().find(name);
    }
    Quantities parameters() const { return of(parameters_); }
    Quantities variables() const { return of(variables_); }
    Quantities inputs() const { return of(inputs_); }
    Quantities recorded() const { return of(recorded_); }
    Quantities checks() const { return of(checks_); }
    FixedNames fixed() const { return {fixed_.data(), static_cast<int>(fixed_.size())}; }

    /// Changes parameters and variables, all or none; `recompute` computes what depends on parameters alone,
    /// and says whether that is defined. Null, or what is wrong.
    template <class F>
    const char* set_parameters(const NewValue* changes, int count, F&& recompute) noexcept {
        try {
            if (const char* wrong = check_changes(*this, changes, count, outside_)) return wrong;
            NamedValues asked;
            for (int i = 0; i < count; ++i) {
                const Quantity* const q = find_parameter(changes[i].name);
                asked.emplace_back(q->name, std::vector<double>(static_cast<std::size_t>(q->size())));
                for (std::size_t e = 0; e < asked.back().second.size(); ++e)
                    asked.back().second[e] = changes[i].values[changes[i].count == 1 ? 0 : e];
            }
            std::vector<std::pair<const Quantity*, std::vector<double>>> before;
            const auto write = [](const Quantity& q, const std::vector<double>& values) {
                write_all(address(q), q, values.data(), static_cast<int>(values.size()));
            };
            for (const auto& [name, values] : tuning_->follow(asked)) {
                const Quantity& q = *parameters().find(name.c_str());
                std::vector<double> old(static_cast<std::size_t>(q.size()));
                for (int i = 0; i < q.size(); ++i)
                    old[static_cast<std::size_t>(i)] = read(address(q), q.type, i);
                before.emplace_back(&q, std::move(old));
                write(q, values);
            }
            const char* const wrong = kernels::keep_or_restore(
                [&] { return check_order(parameters(), address, outside_); },
                [&] { return recompute() ? nullptr : "what follows is not defined for these values"; },
                [&] {
                    for (const auto& [q, values] : before) write(*q, values);
                });
            if (wrong) return wrong;
            tuning_->accept(asked);
            show_variables();
            return nullptr;
        } catch (const std::exception& error) {
            problem_ = error.what();
            return problem_.c_str();
        }
    }
    /// Where a quantity of these tables lies.
    static void* address(const Quantity& q) noexcept { return reinterpret_cast<void*>(q.offset); }

  private:
    int count() const override { return static_cast<int>(diagram_.nodes.size()); }
    const std::string& path(int node) const override {
        return diagram_.nodes[static_cast<std::size_t>(node)].path;
    }
    const Block& block(int node) const override {
        return *diagram_.nodes[static_cast<std::size_t>(node)].block;
    }
    /// Is it the memory of an input of the model, which its caller writes?
    bool is_input(const Node::End& end) const {
        return std::any_of(diagram_.inputs.begin(), diagram_.inputs.end(), [&](const SignalName& input) {
            return input.end.node == end.node && input.end.slot == end.slot;
        });
    }
    static Quantities of(const std::vector<Quantity>& rows) {
        return {rows.data(), static_cast<int>(rows.size())};
    }

    template <class T> void set(Dynamic<T>& member, void* data, int node, int slot) {
        const Size& size = diagram_.slot({node, slot}).size;
        member = {static_cast<T*>(data), size.rows, size.cols};
    }

    const char* keep(const std::string& text) { return texts_.emplace_back(text).c_str(); }

    Quantity row(const std::string& name, const Node::End& end, Where where) {
        const Slot& slot = diagram_.slot(end);
        const bool has_unit = slot.unit.kind == Unit::Kind::exact && slot.unit.text != "1";
        return {keep(name),
                keep(has_unit ? std::string(slot.unit.text) : ""),
                keep(slot.doc),
                static_cast<Type>(slot.type),
                where,
                slot.size.rows,
                slot.size.cols,
                reinterpret_cast<std::size_t>(context_->data(end.node, end.slot)),
                -1,
                slot.limits,
                keep(diagram_.element_lines(end))};
    }

    void make_tables() {
        for (int n = 0; n < count(); ++n) {
            const auto& slots = diagram_.nodes[static_cast<std::size_t>(n)].block->resolution().slots;
            std::map<int, int> rows; // of the block's parameters
            for (int s = 0; s < static_cast<int>(slots.size()); ++s) {
                const Slot& slot = slots[static_cast<std::size_t>(s)];
                if (slot.role != Role::parameter || slot.size.count() == 0) continue;
                rows[s] = static_cast<int>(parameters_.size());
                parameters_.push_back(row(diagram_.end_path({n, s}), {n, s}, Where::parameters));
                if (const auto least = rows.find(slot.at_least); least != rows.end())
                    parameters_.back().at_least = least->second;
            }
        }
        const auto has_elements = [&](const SignalName& signal) {
            return diagram_.slot(signal.end).size.count() > 0;
        };
        for (const auto& check : diagram_.checks())
            if (has_elements(check)) checks_.push_back(row(check.path, check.end, Where::states));
        for (const auto& input : diagram_.inputs)
            if (has_elements(input)) inputs_.push_back(row(input.path, input.end, Where::inputs));
        std::set<std::string> seen;
        for (const auto& signal : diagram_.recorded())
            if (has_elements(signal) && seen.insert(signal.path).second)
                recorded_.push_back(row(signal.path, signal.end, Where::signals));
        for (const auto& variable : tuning_->variables())
            if (!variable.fixed.empty())
                fixed_.push_back({keep(variable.path), keep("while it runs, since " + variable.fixed +
                                                            "; give it in the parameter file")});
            else
                variables_.push_back(
                    {keep(variable.path), keep(variable.unit), keep(variable.about), Type::float64,
                     Where::variables, variable.rows, variable.cols,
                     reinterpret_cast<std::size_t>(values_.emplace_back(variable.values).data()), -1,
                     variable.limits});
        for (const auto& node : diagram_.nodes)
            for (const auto& [name, value] : node.arguments)
                fixed_.push_back(
                    {keep(node.path + "." + name), "it is an argument: give it in the parameter file"});
    }
    void show_variables() {
        std::size_t i = 0;
        for (const auto& variable : tuning_->variables())
            if (variable.fixed.empty())
                std::copy(variable.values.begin(), variable.values.end(), values_[i++].begin());
    }

    Registry registry_; // the code of the blocks below
    Diagram diagram_;
    std::unique_ptr<Context> own_context_;
    std::vector<program::Set> sets_;
    std::unique_ptr<Tuning> tuning_;
    std::deque<std::string> texts_;
    std::deque<std::vector<double>> values_; ///< of variables
    std::deque<std::vector<std::byte>> outputs_;
    std::vector<Quantity> parameters_, variables_, inputs_, recorded_, checks_;
    std::vector<FixedName> fixed_;
    std::string problem_;
    Problem outside_;
};

/// The overrides that a parameter file makes, as `bf run --params` reads it. Throws std::runtime_error.
inline std::vector<ElaborateOptions::Override> read_overrides(const std::string& file) {
    std::string text;
    if (const std::string wrong = read_file(file, text); !wrong.empty())
        throw std::runtime_error("cannot read the parameter file " + file + ": " + wrong);
    std::vector<ElaborateOptions::Override> overrides;
    const auto collect = [&](const auto& self, const std::vector<model::Variable>& variables,
                             const std::string& prefix) -> void {
        for (const auto& variable : variables)
            if (variable.fields.empty())
                overrides.push_back({prefix + variable.name, variable.value.matlab(), variable.value.where});
            else
                self(self, variable.fields, prefix + variable.name + ".");
    };
    collect(collect, formats::read_yaml_variables(text, file), "");
    return overrides;
}

} // namespace bf::generated
