// The variables of a generated model as those of an FMU.
#pragma once

#include "bf/codegen/model_exchange.hpp"
#include "bf/codegen/quantity.hpp"
#include "bf/run/run_c.h"

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <string>
#include <vector>

namespace bf::generated {

/// When a variable can be set: an input of the model and a parameter in and before the run, what only decides
/// initial states before it.
enum class FmuSetting { always, before, none };

/// A variable of the FMU: a row of the model's tables. The first one is the time, which has none.
struct FmuVariable {
    int table; ///< a bf_run_table, or one of the next
    int row;
    FmuSetting setting;
    bool is_enumeration = false; ///< FMI 3.0 reads and writes these as integers of 64 bits
    std::uint64_t clocks = 0;    ///< bits: it has values while one of them is active; none: always
    int start = 0;               ///< of an input whose enumeration has no 0
};

/// A periodic clock, in steps of the model.
struct FmuClock {
    const char* name;
    std::int64_t ticks, offset;
    /// Interval and shift are these counts of 1 / resolution s; 0: no resolution gives them exactly.
    std::uint64_t resolution, interval, shift;
};

/// Continuous states, their derivatives, and zero-crossing functions as one vector.
constexpr int fmu_states = 16, fmu_rates = 17, fmu_crossings = 18;

/// What a model needs whose blocks are made from plugins.
struct FmuHost {
    /// Makes the blocks; false, with the model's failure, where it cannot. `folder`, of the FMU's resources
    /// or empty, becomes that of the model's files and outlives the model.
    bool (*make)(bf_run_model*, std::string& folder);
    std::size_t (*snapshot_size)(bf_run_model*); ///< bytes; 0: some block cannot be saved
    void (*save)(bf_run_model*, unsigned char* to);
    void (*restore)(bf_run_model*, const unsigned char* from);
    std::size_t (*own_size)(bf_run_model*); ///< bytes of the model's class, before those of blocks
    void (*save_blocks)(bf_run_model*, unsigned char* to);
    void (*restore_blocks)(bf_run_model*, const unsigned char* from);
};

struct FmuElement {
    int variable, element;
};

/// Exact derivatives of a model between two of its steps: of continuous states by the time, and of outputs
/// and signals, by states and inputs.
struct FmuDerivatives {
    static constexpr int directions = 4; ///< at once
    /// By the number of the variable; -1: it has no derivative.
    const std::ptrdiff_t* places;
    /// Elements are in the order of memory. Of each unknown its changes along all directions, in which knowns
    /// change as much as the seeds. False where the model fails.
    bool (*compute)(bf_run_model*, double at, const FmuElement* knowns, const double* seeds, int known_count,
                    const FmuElement* unknowns, double* changes, int unknown_count);
};

/// What an FMU does not know of a model of it.
struct FmuTables {
    const bf_run_library* (*library)(void);
    const FmuVariable* variables;
    int variable_count;
    const Exchange* exchange;          ///< for model exchange, or no_exchange
    const FmuHost* host;               ///< null: no block is made from a plugin
    const FmuDerivatives* derivatives; ///< null: they are not known
    /// Are the signals of a step computed alike as often as they are, as long as made blocks begin alike?
    bool are_signals_repeatable;
    const FmuClock* clocks;
    int clock_count; ///< at most 64
};

/// The models of an FMU: one, or one for each combination of values of its structural parameters, whose
/// variables and clocks are the same but for sizes and values.
struct FmuModels {
    const FmuTables* first; ///< that of the description; the others follow
    int count;
    const char* token;              ///< of the description that belongs to this code
    const char* const* parameters;  ///< names of the structural ones
    const std::uint64_t* structure; ///< their values, model by model
    int parameter_count;
    bool has_model_exchange;
};

/// Value references: of FMI 3.0 the number of a variable, of FMI 2.0 that of an element among those of all.
class FmuVariables {
  public:
    struct Variable {
        int table;
        Type type;
        int rows, cols, count;
        FmuSetting setting;
        char* data;
        const char* name;
        bool is_enumeration = false;
        std::uint64_t clocks = 0;
    };
    /// Finds them in the memory of the model; false where the tables are of another one.
    bool bind(const FmuTables& tables, bf_run_model* model, double* time) {
        all_.clear();
        elements_.clear();
        add({bf_run_signals, Type::float64, 1, 1, 1, FmuSetting::none, reinterpret_cast<char*>(time),
             "time"});
        for (int i = 0; i < tables.variable_count; ++i) {
            const FmuVariable& its = tables.variables[i];
            bf_run_quantity q{};
            if (its.table == fmu_crossings) {
                crossings_.resize(std::size_t(tables.exchange->guard_count));
                q.rows = tables.exchange->guard_count;
                q.cols = 1;
                q.type = int(Type::float64);
                q.data = crossings_.data();
                q.path = "event_indicators";
            } else if (!(its.table < fmu_states
                             ? tables.library()->quantity(model, bf_run_table(its.table), its.row, &q)
                             : tables.exchange->quantity(model, its.table == fmu_rates, its.row, &q))) {
                return false;
            }
            const bool can_be_set =
                its.table != bf_run_outputs && its.table != bf_run_signals && its.table < fmu_states;
            const FmuSetting setting = can_be_set ? its.setting : FmuSetting::none;
            for (int e = 0; its.start != 0 && e < q.rows * q.cols; ++e)
                write(q.data, Type(q.type), e, its.start);
            add({its.table, Type(q.type), q.rows, q.cols, q.rows * q.cols, setting,
                 static_cast<char*>(q.data), q.path, its.is_enumeration, its.clocks});
        }
        return true;
    }

    /// The variable of a value reference of FMI 3.0, or null.
    const Variable* variable(std::uint32_t reference) const noexcept {
        return reference < all_.size() ? &all_[reference] : nullptr;
    }
    std::size_t number(const Variable& v) const noexcept { return std::size_t(&v - all_.data()); }
    /// The element of a value reference of FMI 2.0, row by row, or null.
    const FmuElement* element(std::uint32_t reference) const noexcept {
        return reference < elements_.size() ? &elements_[reference] : nullptr;
    }
    const Variable& variable_of(const FmuElement& e) const noexcept { return all_[std::size_t(e.variable)]; }
    bool is_time(const Variable& v) const noexcept { return &v == all_.data(); }
    double* crossings() noexcept { return crossings_.data(); }

    /// Where element i, row by row, of the variable stands in its memory, which is column by column.
    static int place(const Variable& v, int i) noexcept {
        return v.rows == 1 || v.cols == 1 ? i : i % v.cols * v.rows + i / v.cols;
    }

  private:
    void add(const Variable& v) {
        for (int e = 0; e < v.count; ++e) elements_.push_back({int(all_.size()), e});
        all_.push_back(v);
    }

    std::vector<Variable> all_;
    std::vector<FmuElement> elements_;
    std::vector<double> crossings_;
};

} // namespace bf::generated
