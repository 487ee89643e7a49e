// A model as the functions of C by which recorders, viewers and replays run it.
#pragma once

#include "bf/codegen/quantity.hpp"
#include "bf/run/run_c.h"

#include <cstring>
#include <new>
#include <type_traits>

namespace bf::generated {

/// What a table of quantities does not say of its rows.
struct Channel {
    int rate;
    bool is_matrix;
    const bf_run_name* names;
    int name_count;
};

/// In which steps a rate is hit.
struct Hits {
    std::int64_t ticks, offset;
};

/// What a model's class does not know of itself.
struct RunTables {
    const char* name;
    std::uint64_t fingerprint;
    const bf_run_rate* rates;
    const Hits* hits;
    int rate_count;
    const bf_run_panel* plots;
    int plot_count;
    const Channel *recorded, *inputs; ///< by row of their tables
};

namespace detail {
template <class Model, class = void> struct HasObserver : std::false_type {};
template <class Model>
struct HasObserver<Model, std::void_t<decltype(Model::before_event)>> : std::true_type {};

template <class Model, class = void> struct HasTriggers : std::false_type {};
template <class Model>
struct HasTriggers<Model, std::void_t<decltype(&Model::has_fired)>> : std::true_type {};
} // namespace detail

/// The functions for a model with these tables.
template <class Model, const RunTables& (*tables)()> class RunLibrary {
  public:
    static const bf_run_library& get() noexcept {
        static const bf_run_library library = make();
        return library;
    }

  private:
    static constexpr bool can_be_saved = std::is_trivially_copyable<Model>::value;

    static Model* of(bf_run_model* model) noexcept { return reinterpret_cast<Model*>(model); }
    static const Model* of(const bf_run_model* model) noexcept {
        return reinterpret_cast<const Model*>(model);
    }

    static bf_run_library make() noexcept {
        const RunTables& t = tables();
        bf_run_library library{};
        library.name = t.name;
        library.period = Model::period;
        library.stop_time = Model::stop_time;
        library.fingerprint = t.fingerprint;
        library.rates = t.rates;
        library.rate_count = t.rate_count;
        library.plots = t.plots;
        library.plot_count = t.plot_count;
        library.snapshot_size = can_be_saved ? sizeof(Model) : 0;
        library.create = [] { return reinterpret_cast<bf_run_model*>(new (std::nothrow) Model()); };
        library.destroy = [](bf_run_model* model) { delete of(model); };
        library.quantity = quantity;
        library.on_event = on_event;
        library.initialize = [](bf_run_model* model) { return of(model)->initialize(); };
        library.output = [](bf_run_model* model) { return of(model)->output(); };
        library.update = [](bf_run_model* model) { return of(model)->update(); };
        library.terminate = [](bf_run_model* model) { of(model)->terminate(); };
        library.steps = [](const bf_run_model* model) { return of(model)->steps(); };
        library.is_hit = is_hit;
        library.failed_block = [](const bf_run_model* model) { return of(model)->failed_block(); };
        library.failure = [](const bf_run_model* model) { return of(model)->failure(); };
        library.set_parameters = [](bf_run_model* model, const bf_run_value* changes, int count) {
            static_assert(sizeof(bf_run_value) == sizeof(NewValue), "one layout");
            return of(model)->set_parameters(reinterpret_cast<const NewValue*>(changes), count);
        };
        library.save = save;
        library.restore = restore;
        return library;
    }

    static bool quantity(bf_run_model* handle, bf_run_table which, int number, bf_run_quantity* row) {
        Model& model = *of(handle);
        const Quantities table = which == bf_run_signals      ? model.recorded_table()
                                 : which == bf_run_inputs     ? model.input_table()
                                 : which == bf_run_parameters ? model.parameter_table()
                                 : which == bf_run_variables  ? model.variable_table()
                                 : which == bf_run_outputs    ? model.output_table()
                                                              : model.check_table();
        if (number >= table.count) return false;
        const Quantity& q = table.first[number];
        Channel channel{0, q.cols != 1, nullptr, 0};
        if (which == bf_run_signals) channel = tables().recorded[number];
        if (which == bf_run_inputs) channel = tables().inputs[number];
        *row = {q.name,
                q.unit,
                q.doc,
                int(q.type),
                q.rows,
                q.cols,
                channel.is_matrix,
                channel.rate,
                channel.names,
                channel.name_count,
                q.elements,
                model.data(q)};
        return true;
    }

    static void on_event(bf_run_model* handle, void (*call)(void*), void* with) {
        if constexpr (detail::HasObserver<Model>::value) {
            of(handle)->before_event = call;
            of(handle)->observer = with;
        } else {
            static_cast<void>(handle), static_cast<void>(call), static_cast<void>(with);
        }
    }

    static bool is_hit(const bf_run_model* handle, int rate) {
        if constexpr (detail::HasTriggers<Model>::value)
            if (tables().rates[rate].is_triggered) return of(handle)->has_fired(rate);
        const Hits& hits = tables().hits[rate];
        return (of(handle)->steps() - hits.offset) % hits.ticks == 0;
    }

    static void save(const bf_run_model* handle, void* bytes) {
        if constexpr (can_be_saved) {
            std::memcpy(bytes, handle, sizeof(Model));
        } else {
            static_cast<void>(handle), static_cast<void>(bytes);
        }
    }

    static void restore(bf_run_model* handle, const void* bytes) {
        if constexpr (can_be_saved) {
            Model& model = *of(handle);
            if constexpr (detail::HasObserver<Model>::value) {
                const auto call = model.before_event;
                void* const with = model.observer;
                std::memcpy(static_cast<void*>(&model), bytes, sizeof(Model));
                model.before_event = call;
                model.observer = with;
            } else {
                std::memcpy(static_cast<void*>(&model), bytes, sizeof(Model));
            }
        } else {
            static_cast<void>(handle), static_cast<void>(bytes);
        }
    }
};

} // namespace bf::generated
