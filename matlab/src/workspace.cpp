#include "bf/matlab/workspace.hpp"

#include "bf/matlab/error.hpp"

namespace bf::matlab {

const Value* Workspace::find(std::string_view name) const {
    for (const Workspace* here = this; here != nullptr; here = here->enclosing_) {
        const auto place = here->places_.find(name);
        if (place != here->places_.end()) return &here->entries_[place->second].second;
    }
    return nullptr;
}

const Value& Workspace::at(std::string_view name) const {
    if (const Value* value = find(name)) return *value;
    throw Error("unknown variable '" + std::string(name) + "'" + suggestion(name, names()));
}

void Workspace::set(std::string_view name, Value value) {
    const auto place = places_.find(name);
    if (place != places_.end()) {
        entries_[place->second].second = std::move(value);
    } else {
        places_.emplace(name, entries_.size());
        entries_.emplace_back(name, std::move(value));
    }
}

Value Workspace::take(std::string_view name) {
    const auto place = places_.find(name);
    if (place != places_.end()) return std::exchange(entries_[place->second].second, Value());
    const Value* outer = find(name);
    return outer ? *outer : Value();
}

std::vector<std::string_view> Workspace::names() const {
    std::vector<std::string_view> names;
    for (const Workspace* here = this; here != nullptr; here = here->enclosing_)
        for (const Entry& entry : here->entries_) names.push_back(entry.first);
    return names;
}

} // namespace bf::matlab
