// A model whose continuous states a solver of the caller integrates, as functions that know no class.
#pragma once

#include "bf/codegen/quantity.hpp"
#include "bf/run/run_c.h"

#include <cstdint>

namespace bf::generated {

/// Times are those of the model. Functions that compute give false when the model fails.
struct Exchange {
    int continuous_count, guard_count;
    bool is_sampled; ///< does anything happen in steps alone?
    double* (*states)(bf_run_model*);
    double* (*rates)(bf_run_model*);
    bool (*compute_rates)(bf_run_model*, double);
    bool (*compute_crossings)(bf_run_model*, double, double*);
    bool (*compute_signals)(bf_run_model*, double, bool is_event);
    bool (*answer)(bf_run_model*, double);
    bool (*end_step)(bf_run_model*);
    void (*pass)(bf_run_model*, std::int64_t steps); ///< over steps in which nothing is sampled
    /// Continuous state `number` with its elements in a row, or its derivative.
    bool (*quantity)(bf_run_model*, bool is_rate, int number, bf_run_quantity* row);
};

template <class Model> struct ExchangeOf {
    static Model* of(bf_run_model* model) noexcept { return reinterpret_cast<Model*>(model); }
    static bool quantity(bf_run_model* model, bool is_rate, int number, bf_run_quantity* row) {
        const Quantities table = Model::continuous_table();
        if (number >= table.count) return false;
        const Quantity& q = table.first[number];
        *row = {};
        row->path = q.name;
        row->type = int(q.type);
        row->rows = q.size();
        row->cols = 1;
        row->data = is_rate ? reinterpret_cast<char*>(of(model)->rates()) + q.offset : of(model)->data(q);
        return true;
    }
    static constexpr Exchange functions{
        Model::continuous_count,
        Model::guard_count,
        Model::is_sampled,
        [](bf_run_model* m) { return of(m)->continuous_states(); },
        [](bf_run_model* m) { return of(m)->rates(); },
        [](bf_run_model* m, double at) { return of(m)->compute_rates(at); },
        [](bf_run_model* m, double at, double* to) { return of(m)->compute_crossings(at, to); },
        [](bf_run_model* m, double at, bool is_event) { return of(m)->compute_signals(at, is_event); },
        [](bf_run_model* m, double at) { return of(m)->answer(at); },
        [](bf_run_model* m) { return of(m)->end_step(); },
        [](bf_run_model* m, std::int64_t steps) { of(m)->pass(steps); },
        quantity};
};

} // namespace bf::generated
