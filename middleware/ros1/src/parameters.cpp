#include "parameters.hpp"

#include "master.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <condition_variable>
#include <mutex>
#include <set>
#include <stdexcept>
#include <thread>
#include <vector>

namespace bf::ros1 {

namespace {

using middleware::ParameterSource;
using middleware::ServedParameter;
using Kind = ServedParameter::Kind;
using Numbers = std::vector<double>;
using Tree = XmlRpc::XmlRpcValue; ///< a value, or more of them by their names

constexpr std::chrono::milliseconds interval{100}; ///< between two looks at what others set

bool has(const Tree& tree) { return tree.getType() == Tree::TypeStruct; }

/// By its name with dots; null: it is not there.
Tree* find(Tree& tree, const std::string& name) {
    const auto dot = name.find('.');
    const std::string first = name.substr(0, dot);
    if (!has(tree) || !tree.hasMember(first)) return nullptr;
    return dot == name.npos ? &tree[first] : find(tree[first], name.substr(dot + 1));
}
void put(Tree& tree, const std::string& name, const Tree& value) {
    const auto dot = name.find('.');
    if (dot == name.npos)
        tree[name] = value;
    else
        put(tree[name.substr(0, dot)], name.substr(dot + 1), value);
}

Tree element(const ServedParameter& parameter, double value) {
    if (parameter.kind == Kind::truth) return Tree(value != 0);
    // Integers between programs have 32 bits.
    if (parameter.kind == Kind::whole && std::abs(value) <= INT32_MAX) return Tree(static_cast<int>(value));
    return Tree(value);
}
Tree write(const ServedParameter& parameter) {
    if (parameter.is_scalar) return element(parameter, parameter.values[0]);
    Tree all;
    all.setSize(static_cast<int>(parameter.values.size()));
    for (int i = 0; i < all.size(); ++i)
        all[i] = element(parameter, parameter.values[static_cast<std::size_t>(i)]);
    return all;
}

/// Whole numbers are real ones, too; nothing else stands for another type.
double read_element(const ServedParameter& parameter, Tree& from) {
    const bool is_truth = parameter.kind == Kind::truth;
    if (from.getType() == Tree::TypeBoolean && is_truth) return static_cast<bool>(from);
    if (from.getType() == Tree::TypeInt && !is_truth) return static_cast<int>(from);
    if (from.getType() == Tree::TypeDouble && !is_truth) {
        const double value = from;
        if (parameter.kind == Kind::real || value == std::round(value)) return value;
    }
    throw std::runtime_error("'" + parameter.name + "' is of type " +
                             (is_truth                        ? "bool"
                              : parameter.kind == Kind::whole ? "int"
                                                              : "double") +
                             (parameter.is_scalar ? "" : ", as a list") + ", and is given another one");
}
Numbers read(const ServedParameter& parameter, Tree& from) {
    if (parameter.is_scalar || from.getType() != Tree::TypeArray) return {read_element(parameter, from)};
    Numbers all;
    for (int i = 0; i < from.size(); ++i) all.push_back(read_element(parameter, from[i]));
    return all;
}
bool are_same(const Numbers& a, const Numbers& b) {
    return std::ranges::equal(a, b,
                              [](double x, double y) { return x == y || (std::isnan(x) && std::isnan(y)); });
}
void require_change(const ServedParameter& parameter) {
    if (!parameter.fixed.empty())
        throw std::runtime_error("'" + parameter.name +
                                 "' is fixed while the model runs: " + parameter.fixed);
}

class Parameters final : public middleware::ServedParameters {
  public:
    Parameters(ParameterSource& source, const std::string& name_space)
        : source_(source), root_((name_space == "/" ? "" : name_space) + "/model") {
        require_master(master_, root_);
        refuse_values_that_are_folders();
        before_ = get(root_);
        take_first();
        show_all();
        thread_ = std::thread([this] { run(); });
    }
    ~Parameters() override {
        {
            const std::lock_guard lock(mutex_);
            is_over_ = true;
        }
        ends_.notify_all();
        thread_.join();
        has(before_) ? set(root_, before_) : forget(root_);
        forget(root_ + "_shown");
        forget(root_ + "_refused");
    }

  private:
    // ---- the master
    Tree call(const char* method, const std::string& name, const Tree* value = nullptr) const {
        Tree arguments;
        arguments[0] = root_;
        arguments[1] = name;
        if (value != nullptr) arguments[2] = *value;
        return ask(master_, method, arguments, 1, Asked::also_behind_an_interrupt).value_or(Tree());
    }
    Tree get(const std::string& name) const { return call("getParam", name); }
    void set(const std::string& name, const Tree& value) const { call("setParam", name, &value); }
    void forget(const std::string& name) const { call("deleteParam", name); }

    // ---- at the start
    void refuse_values_that_are_folders() {
        std::set<std::string> names;
        for (const auto& its : source_.parameters()) names.insert(its.name);
        for (const auto& name : names)
            for (auto dot = name.find('.'); dot != name.npos; dot = name.find('.', dot + 1))
                if (names.contains(name.substr(0, dot)))
                    throw std::runtime_error("'" + name.substr(0, dot) + "' and '" + name +
                                             "' cannot both be parameters of ROS 1; rename one of them");
    }
    /// What others have set before. What a run has left that was killed is not.
    void take_first() {
        Tree left = get(root_ + "_shown"), mine;
        ParameterSource::Values values;
        for (const auto& parameter : source_.parameters()) {
            Tree* its = find(before_, parameter.name);
            if (its == nullptr) continue;
            if (const Tree* shown = find(left, parameter.name); shown != nullptr && *shown == *its) continue;
            put(mine, parameter.name, *its);
            try {
                const Numbers numbers = read(parameter, *its);
                if (are_same(numbers, parameter.values)) continue;
                require_change(parameter);
                values.emplace_back(parameter.name, numbers);
            } catch (const std::runtime_error& error) {
                throw std::runtime_error("the parameters " + root_ + " of ROS 1: " + error.what());
            }
        }
        if (has(left)) before_ = mine;
        if (values.empty()) return;
        try {
            source_.set(values);
        } catch (const std::runtime_error& error) {
            throw std::runtime_error("the parameters " + root_ + " of ROS 1: " + error.what());
        }
    }
    void show_all() {
        shown_ = source_.parameters();
        Tree all = before_;
        for (const auto& parameter : shown_) put(all, parameter.name, write(parameter));
        if (!has(all)) return;
        set(root_, all);
        mark();
    }
    /// What this run has set.
    void mark() {
        Tree ours;
        for (const auto& parameter : shown_) put(ours, parameter.name, write(parameter));
        set(root_ + "_shown", ours);
    }

    // ---- while it runs
    void run() {
        for (std::unique_lock lock(mutex_); !ends_.wait_for(lock, interval, [&] { return is_over_; });) {
            lock.unlock();
            look();
            lock.lock();
        }
    }
    /// Why not; empty: they are set.
    std::string try_to_set(const ParameterSource::Values& values) {
        try {
            if (!values.empty()) source_.set(values);
            return "";
        } catch (const std::runtime_error& error) {
            return error.what();
        }
    }
    void look() {
        Tree tree = get(root_);
        if (!has(tree)) return show_all(); // of a master that has begun again, or does not answer
        std::string refused;
        bool is_other = false;
        ParameterSource::Values asked;
        for (const auto& parameter : shown_) {
            Tree* its = find(tree, parameter.name);
            try {
                if (its == nullptr) throw std::runtime_error("'" + parameter.name + "' was deleted");
                const Numbers numbers = read(parameter, *its);
                if (are_same(numbers, parameter.values)) continue;
                is_other = true;
                require_change(parameter);
                asked.emplace_back(parameter.name, numbers);
            } catch (const std::runtime_error& error) {
                is_other = true;
                refused = error.what();
            }
        }
        // What the model takes in its first step, and what follows from it, changes by itself.
        const auto is_as_shown = [](const ServedParameter& a, const ServedParameter& b) {
            return are_same(a.values, b.values);
        };
        if (!is_other && std::ranges::equal(shown_, source_.parameters(), is_as_shown)) return;
        if (const std::string why = try_to_set(asked); !why.empty() && asked.size() > 1) {
            for (const auto& value : asked) // those that the model takes
                if (const std::string its = try_to_set({value}); !its.empty()) refused = its;
        } else if (!why.empty()) {
            refused = why;
        }
        shown_ = source_.parameters();
        for (const auto& parameter : shown_) { // also what follows from what was set
            Tree* its = find(tree, parameter.name);
            const auto is_it = [&] {
                try {
                    return its != nullptr && are_same(read(parameter, *its), parameter.values);
                } catch (const std::runtime_error&) {
                    return false;
                }
            };
            if (is_it()) continue;
            std::string name = parameter.name;
            std::ranges::replace(name, '.', '/');
            set(root_ + "/" + name, write(parameter));
        }
        mark();
        if (is_other) set(root_ + "_refused", Tree(refused));
    }

    ParameterSource& source_;
    const std::string root_; ///< name of all
    const Address master_ = master_of_environment();
    Tree before_;
    std::vector<ServedParameter> shown_; ///< as they were last
    std::mutex mutex_;
    std::condition_variable ends_;
    bool is_over_ = false; ///< with the lock
    std::thread thread_;
};

} // namespace

std::unique_ptr<middleware::ServedParameters> serve_parameters(ParameterSource& source,
                                                               const std::string& name_space) {
    return std::make_unique<Parameters>(source, name_space);
}

} // namespace bf::ros1
