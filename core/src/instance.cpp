#include "bf/core/instance.hpp"

namespace bf {

Instance::Instance(const BlockClass& type, const Arguments& arguments)
    : type_(type), block_(type.make(arguments)), borrowed_(declaration().requirements.size()),
      shared_(declaration().provisions.size()) {
    std::string problems;
    for (const auto& problem : declaration().problems) problems += (problems.empty() ? "" : "; ") + problem;
    if (!problems.empty()) throw std::runtime_error(problems);
}

Instance::~Instance() {
    if (has_started_) context_->stop(0);
}

void Instance::give(int parameter, const Value& value) {
    const std::string& name = slot(parameter).name;
    if (value.kind != Value::Kind::number || value.data.empty())
        throw std::runtime_error("parameter '" + name + "' must be a number, not " + value.describe());
    if (const auto wrong = outside_limits(slot(parameter), value.data); !wrong.empty())
        throw std::runtime_error(wrong);
    try {
        bf::give(block_->resolution(), parameter, value);
    } catch (const ResolutionError& error) {
        throw std::runtime_error("parameter '" + name + "' does not fit: " + error.what());
    }
}

void Instance::require(int requirement, std::shared_ptr<const void> resource, std::function<Object()> open) {
    bf::require(*block_, requirement, std::move(resource));
    borrowed_[static_cast<std::size_t>(requirement)] = std::move(open);
}

void Instance::share(int provision, std::shared_ptr<const void> resource, std::function<Object()> open) {
    block_->resolution().provided[static_cast<std::size_t>(provision)] = std::move(resource);
    shared_[static_cast<std::size_t>(provision)] = std::move(open);
}

void Instance::settle() {
    settle_sizes(*block_);
    settle_types(*block_);
}

bool Instance::is_connected(int i, const Connects& connects) const {
    return slot(i).role == Role::input && (!slot(i).optional || (connects && connects(i)));
}

void Instance::require_resolved(const Connects& connects) const {
    for (const int i : unresolved(resolution()))
        throw ResolutionError("the size of " + std::string(name(slot(i).role)) + " '" + slot(i).name +
                              "' cannot be found from the wiring; connect the block, or give a parameter of "
                              "the wanted size");
    for (int i = 0; i < static_cast<int>(resolution().slots.size()); ++i)
        for (const auto& wrong :
             {wrong_size(slot(i), is_connected(i, connects)), below_another(resolution(), i)})
            if (!wrong.empty()) throw ResolutionError(wrong);
}

void Instance::open(const Connects& connects) {
    propagate(*block_);
    require_resolved(connects);
    provide(*block_);
    tasks_ = {};
    context_ = std::make_unique<Context>(
        std::vector<Node>{{block_.get(), type_.methods, {}, {}, 0, borrowed_, shared_}});
    for (int i = 0; i < static_cast<int>(resolution().slots.size()); ++i)
        if (is_connected(i, connects)) context_->use_memory(0, i, {data(i), nullptr, nullptr, true});
    for (const Phase phase : phases)
        for (int i = 0; i < context_->activities(0, phase); ++i)
            tasks_[static_cast<std::size_t>(phase)].push_back(context_->task(0, phase, i));
}

void Instance::start() {
    context_->start(0);
    has_started_ = true;
}

Status Instance::run(Phase phase) {
    for (const Task& task : tasks_[static_cast<std::size_t>(phase)])
        if (const Status status = task(); !status) return status;
    return ok;
}

std::size_t Instance::bytes_of(int i) const {
    return static_cast<std::size_t>(slot(i).size.count()) * static_cast<std::size_t>(bytes(slot(i).type));
}

Object Instance::object(int provision) const {
    const auto& objects = declaration().objects;
    for (std::size_t i = 0; i < objects.size(); ++i)
        if (objects[i].provision == provision)
            return {
                std::shared_ptr<void>(std::shared_ptr<void>(), context_->frame(0).objects[i]), {}, {}, {}};
    return {};
}

} // namespace bf
