// Blocks that are written in Python.
#include "bf/core/kept_text.hpp"
#include "model.hpp"
#include "simulation.hpp"

#include <algorithm>
#include <cstring>
#include <deque>
#include <functional>
#include <map>

namespace bf::python {

namespace {

/// An object of Python that may be let go without the GIL.
class Kept {
  public:
    explicit Kept(nb::object object) : object_(std::move(object)) {}
    ~Kept() {
        if (is_ending()) {
            object_.release(); // the interpreter frees nothing any more
        } else {
            const nb::gil_scoped_acquire python;
            object_.reset();
        }
    }
    Kept(const Kept&) = delete;
    Kept& operator=(const Kept&) = delete;
    nb::handle operator*() const { return object_; }

  private:
    nb::object object_;
};

nb::handle get(const std::shared_ptr<const Kept>& kept) { return **kept; }

/// What a block in Python reads and writes in one running diagram: copies, since Python may keep them longer
/// than the diagram lives.
struct Copies {
    std::vector<std::unique_ptr<Kept>> arrays, targets; ///< by port; targets of next states and rates
    std::vector<void*> data, target_data;
    std::unique_ptr<Kept> at, out, next, rate;
    char message[600] = "";
};

class PythonBlock final : public Block {
  public:
    PythonBlock(std::shared_ptr<const Kept> type, const Arguments& arguments)
        : Block(arguments), copies_{this, [] { return Copies(); }} {
        const nb::gil_scoped_acquire python;
        try {
            const nb::handle cls = get(type);
            nb::object instance = cls.attr("__new__")(cls);
            for (const auto& member : nb::cast<nb::dict>(cls.attr("_members")))
                if (nb::cast<std::string>(member.second.attr("role")) == "argument")
                    argument(instance, member.second);
            for (const auto& member : nb::cast<nb::dict>(cls.attr("_members"))) declare_port(member.second);
            instance.attr("__init__")();
            instance_ = std::make_unique<Kept>(std::move(instance));
        } catch (nb::python_error& error) {
            problem(text_of(error));
        }
    }

    void start(Now at) const override {
        const nb::gil_scoped_acquire python;
        try {
            prepare(at);
            (**instance_).attr("start")(**at[copies_].at);
        } catch (nb::python_error& error) {
            throw std::runtime_error(text_of(error));
        }
    }
    Status reset(Now at, After after) const noexcept override {
        return call(at, "reset", &Copies::next, Before::given,
                    [&](const Port& port) { return port.after ? port.after(after) : nullptr; });
    }
    Status output(Now at, Out out) const noexcept override {
        return call(at, "output", &Copies::out, Before::present,
                    [&](const Port& port) { return port.out ? port.out(out) : nullptr; });
    }
    Status update(Now at, Next next) const noexcept override {
        return call(at, "update", &Copies::next, Before::present,
                    [&](const Port& port) { return port.next ? port.next(next) : nullptr; });
    }
    Status derivative(Now at, Rate rate) const noexcept override {
        return call(at, "derivative", &Copies::rate, Before::zero,
                    [&](const Port& port) { return port.rate ? port.rate(rate) : nullptr; });
    }
    void stop(Now at) const noexcept override {
        if (is_ending()) return;
        const nb::gil_scoped_acquire python;
        try {
            prepare(at);
            (**instance_).attr("stop")(**at[copies_].at);
        } catch (nb::python_error& error) {
            error.discard_as_unraisable("stop of a block");
        } catch (...) {
        }
    }

  private:
    /// A slot, and how its data is reached.
    struct Port {
        std::string name;
        Role role;
        int slot, bytes;
        std::function<void*(Now)> now;
        std::function<void*(Out)> out;
        std::function<void*(Next)> next;
        std::function<void*(Rate)> rate;
        std::function<void*(After)> after;
    };

    /// Also of an exception that cannot say its text, or whose text is no Unicode.
    static std::string text_of(const nb::python_error& error) noexcept {
        std::string text = Py_TYPE(error.value().ptr())->tp_name;
        const nb::object said = nb::steal(PyObject_Str(error.value().ptr()));
        const nb::object bytes = nb::steal(
            said.is_valid() ? PyUnicode_AsEncodedString(said.ptr(), "utf-8", "backslashreplace") : nullptr);
        PyErr_Clear();
        return text + ": " + (bytes.is_valid() ? PyBytes_AsString(bytes.ptr()) : "its text cannot be had");
    }

    template <class T> void read(nb::object& instance, const char* name, AboutArgument<T> about) {
        const Argument<T> made(this, name, std::move(about));
        if constexpr (std::is_same_v<T, Matrix>) {
            const Matrix& m = *made;
            nb::list rows;
            for (int r = 0; r < m.rows(); ++r) {
                nb::list row;
                for (int c = 0; c < m.cols(); ++c) row.append(m(r, c));
                rows.append(row);
            }
            const nb::object numpy = nb::module_::import_("numpy");
            instance.attr("__dict__")[name] =
                m.rows() == 1 ? numpy.attr("array")(rows[0]) : numpy.attr("array")(rows);
        } else {
            instance.attr("__dict__")[name] = *made;
        }
    }
    void argument(nb::object& instance, nb::handle member) {
        const char* name = kept(member.attr("name"));
        const nb::object initial = member.attr("default");
        const auto about = [&]<class T>(T value) {
            return AboutArgument<T>{.initial = std::move(value),
                                    .minimum = nb::cast<double>(member.attr("minimum")),
                                    .above = nb::cast<double>(member.attr("above")),
                                    .maximum = nb::cast<double>(member.attr("maximum")),
                                    .doc = kept(member.attr("doc"))};
        };
        if (nb::isinstance<nb::bool_>(initial)) return read(instance, name, about(nb::cast<bool>(initial)));
        if (nb::isinstance<nb::int_>(initial)) return read(instance, name, about(nb::cast<int>(initial)));
        if (nb::isinstance<nb::float_>(initial))
            return read(instance, name, about(nb::cast<double>(initial)));
        if (nb::isinstance<nb::str>(initial)) {
            auto text = about(nb::cast<std::string>(initial));
            text.choices = nb::cast<std::vector<std::string>>(member.attr("choices"));
            return read(instance, name, std::move(text));
        }
        const nb::object array = nb::module_::import_("numpy").attr("atleast_2d")(initial);
        const auto shape = nb::cast<std::pair<int, int>>(array.attr("shape"));
        const std::vector<double> all = numbers_of(array);
        read(instance, name, about(Matrix(Eigen::Map<const Matrix>(all.data(), shape.first, shape.second))));
    }

    Extent extent(const std::string& name, int plus) {
        if (name.empty()) return plus;
        const auto known = dims_.find(name);
        Extent made = Extent(known != dims_.end() ? known->second
                                                  : dims_.try_emplace(name, this, kept(name)).first->second);
        made.plus = plus;
        return made;
    }
    Shape shape(nb::handle member) {
        const auto lengths = nb::cast<std::vector<std::pair<std::string, int>>>(member.attr("lengths"));
        if (lengths.empty()) return {1};
        if (lengths[0].first == "*") return AnyShape(this);
        if (lengths[0].first.starts_with('*'))
            return shapes_.try_emplace(lengths[0].first, this).first->second;
        if (lengths.size() == 1) return {extent(lengths[0].first, lengths[0].second)};
        return {extent(lengths[0].first, lengths[0].second), extent(lengths[1].first, lengths[1].second)};
    }

    void declare_port(nb::handle member) {
        static const std::map<std::string, Role> roles{{"input", Role::input},
                                                       {"output", Role::output},
                                                       {"parameter", Role::parameter},
                                                       {"discrete_state", Role::discrete_state},
                                                       {"continuous_state", Role::continuous_state}};
        const auto role = roles.find(nb::cast<std::string>(member.attr("role")));
        if (role == roles.end()) return;
        const std::string name = nb::cast<std::string>(member.attr("name"));
        const std::string word = nb::cast<std::string>(member.attr("dtype"));
        const auto type = type_from_name(word == "float64" ? "double" : word == "bool" ? "boolean" : word);
        if (!type)
            return problem("'" + name + "' has no element type '" + word + "'; write double, boolean, int32");
        double elements = 1;
        for (const auto& [length, plus] :
             nb::cast<std::vector<std::pair<std::string, int>>>(member.attr("lengths"))) {
            if (length.empty() && plus < 0)
                return problem("'" + name + "' has a length of " + std::to_string(plus) +
                               "; give one from 0");
            if (length.empty()) elements *= plus;
        }
        constexpr double most_elements = 1e8;
        if (elements > most_elements)
            return problem("'" + name + "' has more than 100 million elements; give a smaller shape");
        About about;
        about.shape = shape(member);
        about.doc = kept(member.attr("doc"));
        about.minimum = nb::cast<double>(member.attr("minimum"));
        about.above = nb::cast<double>(member.attr("above"));
        about.maximum = nb::cast<double>(member.attr("maximum"));
        about.optional = nb::cast<bool>(member.attr("optional"));
        about.feedthrough = nb::cast<bool>(member.attr("feedthrough"));
        about.unit = any_unit;
        if (const std::string unit = nb::cast<std::string>(member.attr("unit")); !unit.empty()) try {
                about.unit = detail::parse_unit(kept(unit));
            } catch (const std::exception&) {
                return problem("'" + name + "' has no unit '" + unit + "'; write 'N', 'm/s', 'rad'");
            }
        with_type(*type, [&](auto element) {
            using E = typename decltype(element)::type;
            declare_key<E>(name, role->second, about, nb::cast<std::vector<double>>(member.attr("initial")));
        });
    }
    template <class E>
    void declare_key(const std::string& name, Role role, const About& about, std::vector<double> initial) {
        using T = Array<E>;
        const auto add = [&](auto key) -> Port& {
            detail::declared_by(*this).slots.back().initial = std::move(initial);
            return ports_.emplace_back(
                Port{name,
                     role,
                     key.index(),
                     static_cast<int>(sizeof(E)),
                     [key](Now at) { return static_cast<void*>(const_cast<E*>(at[key].data())); },
                     {},
                     {},
                     {},
                     {}});
        };
        const auto data = [](auto key) {
            return [key](auto writer) { return static_cast<void*>(writer[key].data()); };
        };
        switch (role) {
        case Role::input: add(Input<T>(this, name, about)); break;
        case Role::parameter: add(bf::Parameter<T>(this, name, about)); break;
        case Role::output: {
            const Output<T> key(this, name, about);
            add(key).out = data(key);
            break;
        }
        case Role::discrete_state: {
            const DiscreteState<T> key(this, name, about);
            Port& port = add(key);
            port.next = data(key);
            port.after = data(key);
            break;
        }
        default: {
            const ContinuousState<T> key(this, name, about);
            Port& port = add(key);
            port.rate = data(key);
            port.after = data(key);
        }
        }
    }

    std::size_t bytes_of(const Port& port) const {
        return static_cast<std::size_t>(resolution().slots[static_cast<std::size_t>(port.slot)].size.count() *
                                        port.bytes);
    }

    /// Makes the copies at the first call, and brings them up to date.
    void prepare(Now at) const {
        Copies& copies = at[copies_];
        if (!copies.at) make(copies);
        for (std::size_t i = 0; i < ports_.size(); ++i)
            std::memcpy(copies.data[i], ports_[i].now(at), bytes_of(ports_[i]));
        nb::dict words = nb::cast<nb::dict>((**copies.at).attr("__dict__"));
        words["time"] = at.time();
        words["period"] = at.period();
        words["step"] = at.step();
    }
    void make(Copies& copies) const {
        const nb::object numpy = nb::module_::import_("numpy"),
                         block = nb::module_::import_("blockfactory._block");
        nb::dict at, out, next, rate;
        for (const Port& port : ports_) {
            const Slot& slot = resolution().slots[static_cast<std::size_t>(port.slot)];
            recording::ChannelInfo info;
            info.rows = static_cast<std::uint32_t>(slot.size.rows);
            info.cols = static_cast<std::uint32_t>(slot.size.cols);
            info.is_matrix = slot.size.is_matrix;
            const auto zeros = [&](std::vector<std::unique_ptr<Kept>>& to, std::vector<void*>& data) {
                nb::object array =
                    numpy.attr("zeros")(shape_of(info), dtype_of(element_type(slot.type)), "F");
                data.push_back(
                    reinterpret_cast<void*>(nb::cast<std::uintptr_t>(array.attr("ctypes").attr("data"))));
                to.push_back(std::make_unique<Kept>(array));
                return array;
            };
            const nb::object array = zeros(copies.arrays, copies.data);
            const nb::object read_only = array.attr("view")();
            read_only.attr("flags").attr("writeable") = false;
            at[port.name.c_str()] = read_only;
            if (port.role == Role::output) {
                copies.targets.emplace_back();
                copies.target_data.push_back(copies.data.back());
                out[port.name.c_str()] = array;
            } else {
                const nb::object target = zeros(copies.targets, copies.target_data);
                if (is_state(port.role)) next[port.name.c_str()] = target;
                if (port.role == Role::continuous_state) rate[port.name.c_str()] = target;
            }
        }
        copies.out = std::make_unique<Kept>(block.attr("Writer")(out));
        copies.next = std::make_unique<Kept>(block.attr("Writer")(next));
        copies.rate = std::make_unique<Kept>(block.attr("Writer")(rate));
        copies.at = std::make_unique<Kept>(block.attr("At")(at));
    }

    enum class Before { present, given, zero }; ///< what is written where the method writes nothing

    /// `target` of a port is where the method's result goes; null: it is not written.
    template <class Target>
    Status call(Now at, const char* method, std::unique_ptr<Kept> Copies::*writer, Before before,
                const Target& target) const noexcept {
        if (is_ending()) return Status::failure("the interpreter ends");
        const nb::gil_scoped_acquire python;
        Copies& copies = at[copies_];
        try {
            prepare(at);
            for (std::size_t i = 0; i < ports_.size(); ++i) {
                const void* to = target(ports_[i]);
                if (!to || !is_state(ports_[i].role)) continue;
                if (before == Before::zero)
                    std::memset(copies.target_data[i], 0, bytes_of(ports_[i]));
                else
                    std::memcpy(copies.target_data[i], before == Before::given ? to : copies.data[i],
                                bytes_of(ports_[i]));
            }
            const nb::object returned = (**instance_).attr(method)(**copies.at, **(copies.*writer));
            if (!returned.is_none())
                throw std::runtime_error(std::string("its method '") + method + "' returned " +
                                         nb::cast<std::string>(nb::str(returned.type().attr("__name__"))) +
                                         ", which nobody takes; write to its last argument");
            for (std::size_t i = 0; i < ports_.size(); ++i)
                if (void* to = target(ports_[i])) std::memcpy(to, copies.target_data[i], bytes_of(ports_[i]));
            return ok;
        } catch (nb::python_error& error) {
            keep_text(copies.message, text_of(error));
            keep_cause(error);
        } catch (const std::exception& error) {
            keep_text(copies.message, error.what());
        }
        return Status::failure(copies.message);
    }

    const char* kept(nb::handle text) { return kept(nb::cast<std::string>(text)); }
    const char* kept(std::string text) { return texts_.emplace_back(std::move(text)).c_str(); }

    Scratch<Copies> copies_;
    std::vector<Port> ports_;
    std::deque<std::string> texts_; ///< that declarations point to
    std::map<std::string, Dim> dims_;
    std::map<std::string, AnyShape> shapes_;
    std::unique_ptr<Kept> instance_;
};

} // namespace

Library library_of(const std::vector<nb::object>& blocks) {
    const nb::object base = nb::module_::import_("blockfactory._block").attr("Block");
    Library library("python");
    for (const nb::object& type : blocks) {
        if (!PyType_Check(type.ptr()) || PyObject_IsSubclass(type.ptr(), base.ptr()) != 1) {
            PyErr_Clear();
            raise("PluginError",
                  nb::cast<std::string>(nb::repr(type)) +
                      " is no block; give classes that are derived from blockfactory.Block, or functions "
                      "with @blockfactory.block");
        }
        const auto overrides = nb::cast<std::vector<std::string>>(type.attr("_overrides"));
        const auto has = [&](const char* method) {
            return std::find(overrides.begin(), overrides.end(), method) != overrides.end();
        };
        const nb::dict members = nb::cast<nb::dict>(type.attr("_members"));
        for (const auto& [role, method] :
             {std::pair("output", "output"), std::pair("continuous_state", "derivative")})
            for (const auto& member : members)
                if (nb::cast<std::string>(member.second.attr("role")) == role && !has(method))
                    raise("PluginError", nb::cast<std::string>(type.attr("__name__")) + " has no method '" +
                                             method + "', which gives '" +
                                             nb::cast<std::string>(member.first) + "' its value");
        const nb::object doc = type.attr("__doc__");
        library.add(BlockClass{library.name(), nb::cast<std::string>(type.attr("__name__")), "python",
                               doc.is_none() ? "" : nb::cast<std::string>(doc),
                               [kept = std::make_shared<const Kept>(type)](
                                   const Arguments& arguments) -> std::unique_ptr<Block> {
                                   return std::make_unique<PythonBlock>(kept, arguments);
                               },
                               Block::Methods{.reset = has("reset"),
                                              .output = has("output"),
                                              .update = has("update"),
                                              .derivative = has("derivative"),
                                              .start = has("start") || has("stop")}});
    }
    return library;
}

} // namespace bf::python
