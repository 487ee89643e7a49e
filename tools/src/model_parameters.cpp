#include "model_parameters.hpp"

#include "bf/elaborate/tuning.hpp"
#include "bf/engine/simulation.hpp"
#include "bf/middleware/served_parameters.hpp"
#include "bf/realtime/runner.hpp"
#include "bf/run/recorder.hpp"
#include "session.hpp"
#include "ways_to_serve.hpp"

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <mutex>
#include <thread>
#include <utility>

namespace bf::tools {

namespace {

using middleware::ServedParameter;

std::string with_unit(const std::string& doc, const std::string& unit) {
    return unit.empty() ? doc : doc + (doc.empty() ? "" : " ") + "[" + unit + "]";
}

class Served final : public ModelParameters, public middleware::ParameterSource {
  public:
    Served(const WayToServe& way, const std::string& where, const LoadedModel& loaded, Simulation& simulation,
           Recorder* recorder)
        : simulation_(simulation), recorder_(recorder), changed_by_(way.parameters_by) {
        const Diagram& diagram = loaded.diagram;
        for (auto& its : Tuning(diagram).variables()) {
            ServedParameter& added = all_.emplace_back();
            added.name = its.path;
            added.doc = with_unit(its.about, its.unit);
            added.fixed = its.fixed;
            if (its.is_logical) added.kind = ServedParameter::Kind::truth;
            added.values = its.values;
            note(its.limits, added);
        }
        for (const auto& quantity : tuned_) {
            ServedParameter& added = all_.emplace_back();
            added.name = quantity.path;
            added.doc = with_unit(quantity.info.doc, quantity.info.unit);
            added.kind = kind_of(quantity.type);
            added.values = quantity.values();
            note(diagram.slot(diagram.find_parameter(quantity.path)).limits, added);
        }
        for (auto& its : all_) its.is_scalar = its.values.size() == 1;
        auto* serve = reinterpret_cast<middleware::ServedParameters* (*)(middleware::ParameterSource&,
                                                                         const std::string&)>(
            function_of(way.plugin, middleware::parameters_symbol, way.option.name, *loaded.registry));
        served_.reset(serve(*this, where));
    }

    ~Served() override {
        served_.reset();
        is_taken(); // what came after its answer is recorded, too
    }

    void apply() noexcept override { mailbox_.apply(simulation_, simulation_.steps()); }
    void alone(const std::function<void()>& what) override {
        const std::lock_guard lock(simulation_in_use_);
        is_taken();
        what();
    }

    std::vector<ServedParameter> parameters() override {
        const std::lock_guard lock(simulation_in_use_);
        if (is_taken()) {
            auto to = all_.begin();
            for (auto& variable : simulation_.variables()) (to++)->values = std::move(variable.values);
            for (const auto& parameter : tuned_) (to++)->values = parameter.values();
            return all_;
        }
        // A model whose time stands still takes it before its next step.
        auto all = all_;
        for (const auto& [name, values] : asked_)
            if (const auto its = std::ranges::find(all, name, &ServedParameter::name); its != all.end())
                its->values = values.size() == its->values.size()
                                  ? values
                                  : std::vector<double>(its->values.size(), values.front());
        return all;
    }
    void set(const Values& values) override {
        std::unique_lock lock(simulation_in_use_);
        if (!is_taken())
            throw std::runtime_error("the last change waits for the next step of the model, whose time "
                                     "stands still; let it go on");
        std::vector<ParameterValue> asked;
        for (const auto& [name, elements] : values) asked.push_back({name, elements});
        auto parameters = simulation_.follow(asked);
        refusal_.clear();
        mailbox_.post(simulation_.prepare(parameters));
        asked_ = std::move(asked);
        parameters_ = std::move(parameters);
        using Clock = std::chrono::steady_clock;
        for (const auto end = Clock::now() + std::chrono::milliseconds(500);
             !is_taken() && Clock::now() < end;) {
            lock.unlock();
            std::this_thread::sleep_for(std::chrono::milliseconds(1));
            lock.lock();
        }
        if (!refusal_.empty()) throw std::runtime_error(refusal_);
    }

  private:
    static ServedParameter::Kind kind_of(Type type) {
        if (type == Type::boolean) return ServedParameter::Kind::truth;
        return type == Type::float64 || type == Type::float32 ? ServedParameter::Kind::real
                                                              : ServedParameter::Kind::whole;
    }
    static void note(const Limits& limits, ServedParameter& parameter) {
        parameter.minimum = std::max(limits.minimum, limits.above);
        parameter.maximum = limits.maximum;
        if (limits.are_given()) parameter.limits = text_of(limits);
    }
    /// Has the loop taken what was asked for last?
    bool is_taken() {
        if (asked_.empty()) return true;
        const auto result = mailbox_.take_result();
        if (!result) return false;
        const auto asked = std::exchange(asked_, {});
        refusal_ = result->status ? "" : result->refusal;
        if (!result->status) return true;
        if (recorder_)
            for (const auto& [path, values] : parameters_)
                recorder_->parameter_changed(result->step, path, values, changed_by_);
        simulation_.accept(asked);
        return true;
    }

    Simulation& simulation_;
    std::mutex simulation_in_use_; ///< but for its steps, which wait for nobody
    Recorder* const recorder_;
    const char* const changed_by_;
    const std::vector<Quantity> tuned_ = simulation_.parameters();
    std::vector<ServedParameter> all_; ///< variables, then parameters of blocks
    realtime::ParameterMailbox mailbox_;
    std::vector<ParameterValue> asked_, parameters_; ///< on their way; and all that follow from them
    std::string refusal_;                            ///< of the last ones; empty: they were taken
    std::unique_ptr<middleware::ServedParameters> served_;
};

} // namespace

std::unique_ptr<ModelParameters> serve_parameters(const std::string& option, const std::string& where,
                                                  const LoadedModel& loaded, Simulation& simulation,
                                                  Recorder* recorder) {
    try {
        return std::make_unique<Served>(way_to_serve(option), where, loaded, simulation, recorder);
    } catch (const std::runtime_error& error) {
        throw CommandError(error.what());
    }
}

} // namespace bf::tools
