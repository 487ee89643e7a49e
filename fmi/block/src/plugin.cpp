// The plugin FMI: FMUs as blocks.
#include "BlockFactory/Core/Log.h"
#include "bf/core/context.hpp"
#include "bf/core/registry.hpp"
#include "bf/fmi/instance.hpp"

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <sstream>
#include <string>
#include <vector>

namespace bf::fmi {

namespace {

namespace fs = std::filesystem;

/// Where an FMU of that name is. It is a program, and where programs are taken from is for the user to say:
/// it is looked for in the folders of plugins that the user named, never beside the model.
fs::path find_fmu(const std::string& name) {
    std::string searched;
    const fs::path relative = fs::path(name).lexically_normal();
    const bool leaves = relative.is_absolute() || (!relative.empty() && *relative.begin() == "..");
    if (const char* path = std::getenv("BLOCKFACTORY_PLUGIN_PATH")) {
        std::istringstream folders(path);
        for (std::string folder; std::getline(folders, folder, ':');) {
            if (folder.empty()) continue;
            searched += (searched.empty() ? "" : ", ") + folder;
            std::error_code error;
            if (!leaves && fs::is_regular_file(folder / relative, error)) return folder / relative;
        }
    }
    throw FmuError(
        "there is no FMU '" + name + "' in the folders that plugins are taken from (" +
        (searched.empty() ? "none is given" : searched) +
        "); an FMU is a program, so that its folder is given to the command: --plugin-path FOLDER");
}

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

/// A variable as a quantity of the block.
struct Port {
    int variable; ///< its number
    int slot;
    Type type;
    std::function<void*(Now)> memory;
};

/// Values on their way between the block's memory and an instance.
class Transfer {
  public:
    Transfer(const Description& d, const std::vector<Port>& ports) {
        std::map<Type, std::size_t> groups;
        for (const auto& port : ports) {
            const auto& v = d.variables[static_cast<std::size_t>(port.variable)];
            const Type type = d.version == 2 && v.type == Type::float32 ? Type::float64 : v.type;
            const auto [at, is_new] = groups.emplace(type, values_.size());
            if (is_new) values_.emplace_back(d.version, type);
            const int cols = v.dimensions.size() < 2 ? 1 : v.count() / v.dimensions[0];
            const int rows = v.count() / std::max(cols, 1);
            items_.push_back({at->second, values_[at->second].add(v), &port,
                              type_of_signal(d.version, v.type), rows, cols});
        }
    }

    /// Arrays of FMI are row by row, ours column by column.
    bool write_to(Instance& instance, Now at) {
        for (const auto& item : items_)
            for (int i = 0; i < item.rows * item.cols; ++i)
                values_[item.group].set(item.first + static_cast<std::size_t>(i),
                                        read_value(item.port->memory(at), item.type, place(item, i)));
        return std::all_of(values_.begin(), values_.end(), [&](const Values& v) { return instance.set(v); });
    }
    bool read_from(Instance& instance, Now at) {
        if (!std::all_of(values_.begin(), values_.end(), [&](Values& v) { return instance.get(v); }))
            return false;
        for (const auto& item : items_)
            for (int i = 0; i < item.rows * item.cols; ++i)
                write(item.port->memory(at), item.type, place(item, i),
                      values_[item.group][item.first + static_cast<std::size_t>(i)]);
        return true;
    }
    /// Is any value another one than was written last?
    bool differs(Now at) const {
        for (const auto& item : items_)
            for (int i = 0; i < item.rows * item.cols; ++i) {
                const double now = read_value(item.port->memory(at), item.type, place(item, i)),
                             before = values_[item.group][item.first + static_cast<std::size_t>(i)];
                if (std::memcmp(&now, &before, sizeof now) != 0) return true;
            }
        return false;
    }

  private:
    struct Item {
        std::size_t group, first;
        const Port* port;
        bf::Type type;
        int rows, cols;
    };
    static void write(void* to, bf::Type type, int i, double x) {
        with_type(type, [&](auto t) {
            using T = typename decltype(t)::type;
            static_cast<T*>(to)[i] = static_cast<T>(x);
        });
    }
    static int place(const Item& item, int i) { return i % item.cols * item.rows + i / item.cols; }

    std::vector<Values> values_;
    std::vector<Item> items_;
};

/// The running FMU of one context: made by start, part of snapshots where the FMU can save itself.
class Running {
  public:
    explicit Running(fs::path archive, const Description& d) : archive_(std::move(archive)) {
        const auto& its = d.co_simulation;
        can_save_ = its && its->has_state && its->can_serialize;
    }

    bool can_save() const { return can_save_; }
    std::size_t state_size() {
        if (!instance || !instance->save(bytes_)) bytes_.clear();
        return 2 + (bytes_.size() + sizeof(double) - 1) / sizeof(double);
    }
    /// The length in bytes, whether it was initialised, then the bytes.
    void save(double* to) {
        to[0] = static_cast<double>(bytes_.size());
        to[1] = is_initialized;
        std::memcpy(to + 2, bytes_.data(), bytes_.size());
    }
    void restore(const double* from) {
        if (!instance) return;
        bytes_.resize(static_cast<std::size_t>(from[0]));
        std::memcpy(bytes_.data(), from + 2, bytes_.size());
        is_initialized = from[1] != 0;
        if (!bytes_.empty()) is_restored = instance->restore(bytes_);
    }

    void open(const std::string& name) {
        instance.reset();
        if (!library_) library_ = std::make_unique<Library>(archive_);
        instance = std::make_unique<Instance>(
            *library_, name, [name](int status, const std::string&, const std::string& text) {
                if (status != 0) bfWarning << name << ": " << text;
            });
        is_initialized = false;
    }
    void close() noexcept {
        instance.reset();
        library_.reset();
    }

  private:
    fs::path archive_;
    std::unique_ptr<Library> library_; // outlives the instance
    bool can_save_ = false;
    std::vector<std::uint8_t> bytes_;

  public:
    std::unique_ptr<Instance> instance;
    bool is_initialized = false, is_restored = true;
    char message[700] = "";
    std::optional<Transfer> parameters, inputs, early_inputs, outputs;
};

class FmuBlock final : public Block {
  public:
    explicit FmuBlock(const Arguments& arguments) : Block(arguments) {
        if (fmu->empty()) return; // described without a model
        try {
            archive_ = find_fmu(*fmu);
            description_ = fmi::description_of(archive_);
            if (!description_.co_simulation)
                throw FmuError(archive_.string() +
                               ": it is for model exchange alone; have it exported for co-simulation");
            declare_ports();
        } catch (const FmuError& error) {
            problem(error.what());
        }
    }

    bool feedthrough(int output, int input) const override {
        const auto its =
            std::find_if(outputs_.begin(), outputs_.end(), [&](const Port& p) { return p.slot == output; });
        const auto by =
            std::find_if(inputs_.begin(), inputs_.end(), [&](const Port& p) { return p.slot == input; });
        return its != outputs_.end() && by != inputs_.end() && depends(its->variable, by->variable);
    }

    void start(Now at) const override {
        if (at.period() <= 0)
            throw std::runtime_error(
                "an FMU for co-simulation does steps of a fixed length; give the block a period");
        Running& its = at[running_];
        its.open(archive_.filename().string());
        its.parameters.emplace(description_, parameters_);
        its.inputs.emplace(description_, inputs_);
        its.early_inputs.emplace(description_, early_inputs_);
        its.outputs.emplace(description_, outputs_);
        if (!begin(at)) throw std::runtime_error(its.instance->failure());
    }
    Status reset(Now at, After) const noexcept override {
        Running& its = at[running_];
        if (!its.instance || !its.is_initialized) return ok;
        return its.instance->reset() && begin(at) ? ok : failure(its);
    }
    Status output(Now at, Out) const noexcept override {
        Running& its = at[running_];
        if (!its.instance) return Status::failure("the FMU was not started");
        if (!its.is_restored) return failure(its);
        if (!tune(at)) return failure(its);
        if (!its.early_inputs->write_to(*its.instance, at)) return failure(its);
        if (!its.is_initialized && !its.instance->exit_initialization()) return failure(its);
        its.is_initialized = true;
        return its.outputs->read_from(*its.instance, at) ? ok : failure(its);
    }
    Status update(Now at, Next) const noexcept override {
        Running& its = at[running_];
        return its.inputs->write_to(*its.instance, at) && its.instance->do_step(at.time(), at.period())
                   ? ok
                   : failure(its);
    }
    void stop(Now at) const noexcept override { at[running_].close(); }

    bf::Argument<std::string> fmu{
        this, "fmu", {.doc = "file of the FMU, in a folder that plugins are taken from (--plugin-path)"}};

  private:
    /// The text stays when the instance is closed.
    static Status failure(Running& its) noexcept {
        std::snprintf(its.message, sizeof its.message, "%s", its.instance->failure());
        return Status::failure(its.message);
    }

    bool begin(Now at) const noexcept {
        Running& its = at[running_];
        its.is_initialized = false;
        return its.parameters->write_to(*its.instance, at) && its.instance->enter_initialization(at.time());
    }
    /// Parameters that were changed since the last step.
    bool tune(Now at) const noexcept {
        Running& its = at[running_];
        return !its.parameters->differs(at) || its.parameters->write_to(*its.instance, at);
    }

    bool depends(int output, int input) const {
        for (const auto& unknown : description_.outputs)
            if (unknown.variable == output)
                return !unknown.dependencies ||
                       std::find(unknown.dependencies->begin(), unknown.dependencies->end(), input) !=
                           unknown.dependencies->end();
        return true; // nothing is said of it
    }

    /// "controller.K[1,2]" as a name of the block: "controller_K_1_2".
    std::string name_of(const Variable& v) {
        std::string name;
        for (const char c : v.name) {
            const bool is_plain = std::isalnum(static_cast<unsigned char>(c)) || c == '_';
            if (is_plain)
                name += c;
            else if (!name.empty() && name.back() != '_')
                name += '_';
        }
        while (!name.empty() && name.back() == '_') name.pop_back();
        if (name.empty() || std::isdigit(static_cast<unsigned char>(name.front()))) name = "v" + name;
        std::string unique = name;
        for (int i = 2; !names_.insert(unique).second; ++i) unique = name + "_" + std::to_string(i);
        return unique;
    }

    void declare_ports() {
        names_.insert("fmu");
        for (int number = 0; number < static_cast<int>(description_.variables.size()); ++number) {
            const Variable& v = description_.variables[static_cast<std::size_t>(number)];
            if (!has_values(v.type)) continue;
            if (v.causality == Causality::input)
                inputs_.push_back(declare<Role::input>(number, v));
            else if (v.causality == Causality::output)
                outputs_.push_back(declare<Role::output>(number, v));
            else if (v.causality == Causality::parameter && !v.start.empty())
                parameters_.push_back(declare<Role::parameter>(number, v));
        }
        for (const auto& input : inputs_)
            if (std::any_of(outputs_.begin(), outputs_.end(),
                            [&](const Port& output) { return depends(output.variable, input.variable); }))
                early_inputs_.push_back(input);
    }

    template <Role role> Port declare(int number, const Variable& v) {
        About about;
        const int cols = v.dimensions.size() < 2 ? 1 : v.count() / std::max(v.dimensions[0], 1);
        const int rows = v.dimensions.empty() ? 1 : v.dimensions[0];
        if (v.dimensions.size() > 1)
            about.shape = {rows, cols};
        else
            about.shape = {rows};
        about.unit = any_unit;
        const std::string doc =
            v.name + (v.unit.empty() ? "" : " [" + v.unit + "]") + (v.doc.empty() ? "" : ": " + v.doc);
        if (role == Role::parameter) {
            if (v.minimum) about.minimum = *v.minimum;
            if (v.maximum) about.maximum = *v.maximum;
        }
        const std::string name = name_of(v);
        Port port{number, -1, v.type, {}};
        const auto make = [&](auto t, auto scalar) {
            using Element = typename decltype(t)::type;
            using T = std::conditional_t<decltype(scalar)::value, Element, Array<Element>>;
            const Key<T, role> key(this, name, about);
            port.slot = key.index();
            port.memory = [key](Now at) -> void* {
                if constexpr (decltype(scalar)::value)
                    return const_cast<Element*>(&at[key]);
                else
                    return const_cast<Element*>(at[key].data());
            };
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
            for (int i = 0; i < rows * cols; ++i)
                slot.initial[static_cast<std::size_t>(i % cols * rows + i / cols)] =
                    v.start[static_cast<std::size_t>(i)];
        }
        return port;
    }

    fs::path archive_;
    Description description_;
    std::set<std::string> names_;
    std::vector<Port> inputs_, early_inputs_, outputs_, parameters_;
    OutsideState<Running> running_{this,
                                   [this] { return std::make_shared<Running>(archive_, description_); }};
};

} // namespace

} // namespace bf::fmi

extern "C" void bf_plugin_v1(bf::Library& library) {
    library.group("fmi").add<bf::fmi::FmuBlock>("FMU",
                                                "An FMU of FMI 2.0 or 3.0 for co-simulation, which steps "
                                                "with the block's period. Ports, parameters, types "
                                                "and sizes are those of its description; an output waits for "
                                                "those inputs that the description names.");
}
