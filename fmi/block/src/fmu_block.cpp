#include "fmu_block.hpp"

#include "BlockFactory/Core/Log.h"
#include "bf/base/numbers.hpp"
#include "bf/core/kept_text.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <map>
#include <stdexcept>

namespace bf::fmi {

namespace {

/// The type of a signal that holds values of that type of FMI.
bf::Type type_of_signal(int version, Type type) {
    switch (type) {
    case Type::float32: return version == 2 ? bf::Type::float64 : bf::Type::float32;
    case Type::int8: return bf::Type::int8;
    case Type::uint8: return bf::Type::uint8;
    case Type::int16: return bf::Type::int16;
    case Type::uint16: return bf::Type::uint16;
    case Type::int32:
    case Type::enumeration: return bf::Type::int32;
    case Type::uint32: return bf::Type::uint32;
    case Type::boolean: return bf::Type::boolean;
    default: return bf::Type::float64; // also integers of 64 bits, which are exact up to 2^53
    }
}

/// By its definition, else by its name where that is a unit of ours. Wires carry numbers as they are, so that
/// one of another size than base units have agrees with all, and a warning says so.
Unit unit_of(const Description& d, const Variable& v, const std::string& fmu) {
    const auto defined = d.units.find(v.unit);
    Unit unit = any_unit;
    if (defined == d.units.end()) {
        try {
            if (!v.unit.empty()) unit = detail::parse_unit(v.unit);
        } catch (const std::invalid_argument&) { // a text for people
        }
    } else if (defined->second.factor == 1 && defined->second.offset == 0) {
        unit = {v.unit, {}};
        std::copy(defined->second.exponents.begin(), defined->second.exponents.end(), unit.si.begin());
    } else {
        bfWarning << fmu << ": '" << v.name << "' is in " << v.unit << ", of which 1 is "
                  << number_text(defined->second.factor + defined->second.offset)
                  << " of base units; wires carry numbers as they are, so convert what comes and goes";
    }
    return unit;
}

template <class T, Role role> std::function<void*(Now)> memory_of(const Key<T, role>& key) {
    using Element = typename ElementOf<T>::type;
    return [key](Now at) -> void* {
        if constexpr (std::is_same_v<T, Element>)
            return const_cast<Element*>(&at[key]);
        else
            return const_cast<Element*>(at[key].data());
    };
}

void write_value(void* to, bf::Type type, int i, double x) {
    with_type(type, [&](auto t) {
        using T = typename decltype(t)::type;
        static_cast<T*>(to)[i] = static_cast<T>(x);
    });
}

} // namespace

// ---- values

Transfer::Transfer(const Description& d, const Ports& ports,
                   const std::function<bool(const Port&)>& is_wanted) {
    std::map<Type, std::size_t> groups;
    for (const auto& port : ports) {
        if (!is_wanted(port)) continue;
        const auto& v = d.variables[static_cast<std::size_t>(port.variable)];
        const Type type = d.version == 2 && v.type == Type::float32 ? Type::float64 : v.type;
        const auto [at, is_new] = groups.emplace(type, values_.size());
        if (is_new) values_.emplace_back(d.version, type);
        const bf::Type of_signal = type_of_signal(d.version, v.type);
        items_.push_back(
            {at->second, values_[at->second].add(v), &port, of_signal, v.rows(), v.cols(), written_.size()});
        written_.resize(written_.size() + static_cast<std::size_t>(v.count() * bytes(of_signal)));
    }
}

/// Arrays of FMI are row by row, ours column by column.
bool Transfer::write_to(Instance& instance, Now at) noexcept {
    for (const auto& item : items_) {
        const void* const from = item.port->memory(at);
        for (int i = 0; i < item.rows * item.cols; ++i)
            values_[item.group].set(item.first + static_cast<std::size_t>(i),
                                    read_value(from, item.type, place(item, i)));
        std::copy_n(static_cast<const std::byte*>(from), size(item), written_.data() + item.written);
    }
    return std::all_of(values_.begin(), values_.end(), [&](const Values& v) { return instance.set(v); });
}

bool Transfer::read_from(Instance& instance, Now at) noexcept {
    if (!std::all_of(values_.begin(), values_.end(), [&](Values& v) { return instance.get(v); }))
        return false;
    for (const auto& item : items_) {
        void* const to = item.port->memory(at);
        for (int i = 0; i < item.rows * item.cols; ++i)
            write_value(to, item.type, place(item, i),
                        values_[item.group][item.first + static_cast<std::size_t>(i)]);
    }
    return true;
}

bool Transfer::differs(Now at) const noexcept {
    return std::any_of(items_.begin(), items_.end(), [&](const Item& item) {
        return std::memcmp(written_.data() + item.written, item.port->memory(at), size(item)) != 0;
    });
}

// ---- the running FMU

namespace {
constexpr std::size_t header = 2 + sizeof(Running::Memory) / sizeof(double); ///< numbers before the bytes
} // namespace

Running::Running(std::filesystem::path archive, const Description& d, Kind kind, Structure structure,
                 double timeout)
    : archive_(std::move(archive)), description_(d), kind_(kind), structure_(std::move(structure)),
      timeout_(timeout), clockwork(d, archive_.string()) {
    const auto& its = kind == Kind::co_simulation ? d.co_simulation : d.model_exchange;
    can_save_ = its && its->has_state && its->can_serialize;
}

std::size_t Running::state_size() {
    bytes_.clear();
    // A snapshot without it would go on from another state.
    if (instance && !instance->save(bytes_)) throw std::runtime_error(instance->failure());
    return header + (bytes_.size() + sizeof(double) - 1) / sizeof(double);
}

/// The length in bytes, in which mode the instance is, what the block remembers, then the bytes.
void Running::save(double* to) const {
    to[0] = static_cast<double>(bytes_.size());
    to[1] = static_cast<double>(instance ? instance->state() : no_state);
    std::memcpy(to + 2, &memory, sizeof memory);
    std::memcpy(to + header, bytes_.data(), bytes_.size());
}

void Running::restore(const double* from) {
    if (!instance) return;
    bytes_.resize(static_cast<std::size_t>(from[0]));
    std::memcpy(static_cast<void*>(&memory), from + 2, sizeof memory);
    std::memcpy(bytes_.data(), from + header, bytes_.size());
    if (!bytes_.empty())
        is_restored = instance->restore(bytes_, static_cast<State>(static_cast<unsigned>(from[1])));
}

void Running::open() {
    instance.reset();
    const std::string name = archive_.filename().string();
    const Instance::Log log = [name](int status, const std::string&, const std::string& text) {
        if (status != 0) bfWarning << name << ": " << text;
    };
    if (timeout_ > 0) {
        instance = make_remote_instance(archive_, description_, kind_, name, timeout_, log, structure_);
    } else {
        if (!library_) library_ = std::make_unique<Library>(archive_, description_, kind_, structure_);
        instance = std::make_unique<LocalInstance>(*library_, name, log);
    }
    memory = {};
    is_restored = true;
}

void Running::close() noexcept {
    instance.reset();
    library_.reset();
}

double Running::slack(Now at) noexcept { return 1e-9 * std::max(1.0, std::abs(at.time())); }

bool Running::write_clocked(Now at, Transfer Clocked::*which) noexcept {
    return std::all_of(clocked.begin(), clocked.end(), [&](Clocked& its) {
        return !clockwork.is_active(its.clocks) || (its.*which).write_to(*instance, at);
    });
}

bool Running::read_clocked(Now at) noexcept {
    return std::all_of(clocked.begin(), clocked.end(), [&](Clocked& its) {
        return !clockwork.is_active(its.clocks) || its.outputs.read_from(*instance, at);
    });
}

bool Running::end_event(Now at, Event& event) noexcept {
    if (!instance->handle_event(event)) return false;
    if (clockwork.is_some_active()) memory.ticked = at.time();
    clockwork.end();
    return true;
}

Status Running::failure(const char* text) noexcept {
    keep_text(message_, text);
    return Status::failure(message_);
}

// ---- the block

FmuBlock::FmuBlock(const Arguments& arguments, Kind kind)
    : Block(arguments), running_(this, [this, kind] {
          return std::make_shared<Running>(archive_, description_, kind, structure_of_arguments(),
                                           *process == "own" ? *timeout : 0.0);
      }) {
    if (fmu->empty()) return; // described without a model
    try {
        archive_ = find_fmu(*fmu);
        auto described = fmi::description_of(archive_, structure_of_arguments());
        if (!(kind == Kind::co_simulation ? described.co_simulation : described.model_exchange))
            throw FmuError(archive_.string() +
                           (kind == Kind::co_simulation
                                ? ": it is for model exchange alone; use the block FMI/ModelExchange"
                                : ": it is for co-simulation alone; use the block FMI/FMU"));
        const Clockwork clockwork(described, archive_.string());
        if (described.has_clocks() && kind == Kind::co_simulation && !described.co_simulation->has_event_mode)
            throw FmuError(archive_.string() +
                           ": it has clocks, but no event mode in which they tick (FMI 3.0, section 4.4)");
        description_ = std::move(described);
        declare_ports(kind);
    } catch (const FmuError& error) {
        problem(error.what());
    }
}

Structure FmuBlock::structure_of_arguments() const {
    Structure all;
    for (const auto& item : *structure) {
        const auto at = item.rfind('=');
        const auto value = at == std::string::npos ? std::nullopt : number_of(item.substr(at + 1));
        if (!value || at == 0)
            throw FmuError("'structure' has '" + item + "', which gives no parameter a number; write n=3");
        all[item.substr(0, at)] = *value;
    }
    return all;
}

std::vector<Running::Clocked> FmuBlock::clocked() const {
    std::vector<Running::Clocked> all;
    for (const auto* ports : {&inputs_, &outputs_})
        for (const auto& port : *ports) {
            const auto& clocks = port.clocks;
            if (clocks.empty() ||
                std::any_of(all.begin(), all.end(), [&](const auto& its) { return its.clocks == clocks; }))
                continue;
            all.push_back(
                {clocks,
                 {description_, inputs_, [&](const Port& p) { return p.clocks == clocks && p.is_early; }},
                 {description_, inputs_, [&](const Port& p) { return p.clocks == clocks && !p.is_early; }},
                 {description_, outputs_, [&](const Port& p) { return p.clocks == clocks; }}});
        }
    return all;
}

bool FmuBlock::feedthrough(int output, int input) const {
    const auto of_slot = [](const Ports& ports, int slot) {
        return std::find_if(ports.begin(), ports.end(), [&](const Port& p) { return p.slot == slot; });
    };
    const auto its = of_slot(outputs_, output), by = of_slot(inputs_, input);
    return its != outputs_.end() && by != inputs_.end() && depends(its->variable, by->variable);
}

bool FmuBlock::depends(int output, int input) const {
    for (const auto& unknown : description_.outputs)
        if (unknown.variable == output)
            return !unknown.dependencies ||
                   std::find(unknown.dependencies->begin(), unknown.dependencies->end(), input) !=
                       unknown.dependencies->end();
    return true; // nothing is said of it
}

void FmuBlock::declare_ports(Kind kind) {
    const auto names = block_names(description_, kind);
    for (int number = 0; number < static_cast<int>(description_.variables.size()); ++number) {
        const Variable& v = description_.variables[static_cast<std::size_t>(number)];
        const std::string& name = names[static_cast<std::size_t>(number)];
        if (name.empty()) continue;
        if (v.causality == Causality::input)
            inputs_.push_back(declare<Role::input>(number, v, name));
        else if (v.causality == Causality::output)
            outputs_.push_back(declare<Role::output>(number, v, name));
        else
            parameters_.push_back(declare<Role::parameter>(number, v, name));
    }
    for (auto& input : inputs_)
        input.is_early = std::any_of(outputs_.begin(), outputs_.end(), [&](const Port& output) {
            return depends(output.variable, input.variable);
        });
}

template <Role role> Port FmuBlock::declare(int number, const Variable& v, const std::string& name) {
    About about;
    if (v.dimensions.size() > 1)
        about.shape = {v.rows(), v.cols()};
    else
        about.shape = {v.rows()};
    about.unit = unit_of(description_, v, archive_.filename().string());
    const std::string doc =
        v.name + (v.unit.empty() ? "" : " [" + v.unit + "]") + (v.doc.empty() ? "" : ": " + v.doc);
    if (role == Role::parameter) {
        if (v.minimum) about.minimum = *v.minimum;
        if (v.maximum) about.maximum = *v.maximum;
    }
    Port port{
        number, -1, v.variability == Variability::continuous, v.variability == Variability::tunable, v.clocks,
        false,  {}};
    const auto make = [&](auto t, auto scalar) {
        using Element = typename decltype(t)::type;
        using T = std::conditional_t<decltype(scalar)::value, Element, Array<Element>>;
        const Key<T, role> key(this, name, about);
        port.slot = key.index();
        port.memory = memory_of(key);
    };
    with_type(type_of_signal(description_.version, v.type), [&](auto t) {
        if (v.dimensions.empty())
            make(t, std::true_type());
        else
            make(t, std::false_type());
    });
    auto& slot = detail::declared_by(*this).slots[static_cast<std::size_t>(port.slot)];
    slot.doc = doc;
    if (role == Role::input) slot.optional = true;
    if (role != Role::output && !v.start.empty()) {
        slot.initial.resize(v.start.size());
        for (int i = 0; i < v.count(); ++i)
            slot.initial[static_cast<std::size_t>(column_by_column(i, v.rows(), v.cols()))] =
                v.start[static_cast<std::size_t>(i)];
    }
    return port;
}

} // namespace bf::fmi
