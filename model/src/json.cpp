#include "json.hpp"

#include "bf/model/suggest.hpp"

#include <charconv>

namespace bf::model {
namespace {

using namespace operations;

/// The operations by their names in JSON, in the order of the variant.
const std::vector<std::string> verbs = {"add",      "remove",       "rename",          "reorder",
                                        "connect",  "disconnect",   "name_signal",     "set",
                                        "add_port", "set_variable", "rename_variable", "move",
                                        "resize",   "flip",         "rotate",          "place_port",
                                        "bend",     "label",        "annotate",        "group",
                                        "dissolve", "inline",       "extract",         "record",
                                        "plot",     "watch",        "patch",           "batch"};

template <std::size_t Index = 0> Operation make(std::size_t index) {
    if constexpr (Index < std::variant_size_v<Operation>)
        return index == Index ? Operation(std::in_place_index<Index>) : make<Index + 1>(index);
    else
        return {};
}

/// Collects changes while it walks two values side by side.
class Differences {
  public:
    explicit Differences(JsonContext& context) : context_(context) {}

    std::vector<Change> changes;

    template <typename T>
    void add(const T& before, const T& after, const std::string& at, const choices::Words* words = nullptr) {
        if (are_equal(before, after, true)) return;
        if constexpr (is_vector<T>) {
            add_list(before, after, at);
        } else if constexpr (std::is_same_v<T, OwnSystem>) {
            if (before && after) return add(*before, *after, at);
            replace(after, at, words);
        } else if constexpr (Listed<T> && !std::is_same_v<T, Reference> && !std::is_same_v<T, Location>) {
            for_each_field<T>([&](const auto& field) {
                add(before.*field.member, after.*field.member, (at.empty() ? "" : at + "/") + field.name,
                    field.words);
            });
        } else {
            replace(after, at, words);
        }
    }

  private:
    template <typename T> void replace(const T& value, const std::string& at, const choices::Words* words) {
        changes.push_back({at, {}, value_to_json(value, context_, words).dump()});
    }

    template <typename Item>
    void add_list(const std::vector<Item>& before, const std::vector<Item>& after, const std::string& at) {
        std::size_t first = 0, last_before = before.size(), last_after = after.size();
        const auto same = [](const Item& a, const Item& b) { return are_equal(a, b, true); };
        while (first < last_before && first < last_after && same(before[first], after[first])) ++first;
        while (first < last_before && first < last_after &&
               same(before[last_before - 1], after[last_after - 1]))
            --last_before, --last_after;
        if constexpr (Listed<Item>)
            if (last_before - first == last_after - first) {
                for (std::size_t i = first; i < last_before; ++i)
                    add(before[i], after[i], at + "/" + std::to_string(i));
                return;
            }
        const std::vector<Item> inserted(after.begin() + first, after.begin() + last_after);
        changes.push_back({at + "/" + std::to_string(first), last_before - first,
                           value_to_json(inserted, context_).dump()});
    }

    JsonContext& context_;
};

[[noreturn]] void refuse_patch(const std::string& at) {
    throw Errors({{{},
                   "",
                   "the patch does not fit the model at '" + at + "'",
                   "apply it to the model that the operation left behind"}});
}

/// Puts one change into the part of the model that the rest of its path names.
class Patching {
  public:
    Patching(const Change& change, JsonContext& context)
        : change_(change), context_(context), rest_(change.at) {
        json_ = Json::parse(change.value, nullptr, false);
        if (json_.is_discarded()) refuse_patch(change.at);
    }

    template <typename T> void change(T& target, const choices::Words* words = nullptr) {
        if (rest_.empty() && !change_.removed)
            return value_from_json(json_, target, context_, change_.at, words);
        if (rest_.empty()) refuse_patch(change_.at);
        if constexpr (std::is_same_v<T, OwnSystem>) {
            if (target) return change(*target);
        } else if constexpr (is_vector<T>) {
            return change_item(target);
        } else if constexpr (Listed<T>) {
            const std::string name = next();
            bool found = false;
            for_each_field<T>([&](const auto& field) {
                if (found || name != field.name) return;
                found = true;
                change(target.*field.member, field.words);
            });
            if (found) return;
        }
        refuse_patch(change_.at);
    }

  private:
    std::string next() {
        const std::size_t slash = rest_.find('/');
        const std::string part(rest_.substr(0, slash));
        rest_.remove_prefix(slash == rest_.npos ? rest_.size() : slash + 1);
        return part;
    }

    template <typename Item> void change_item(std::vector<Item>& list) {
        const std::string part = next();
        std::size_t index = 0;
        const auto [end, error] = std::from_chars(part.data(), part.data() + part.size(), index);
        if (error != std::errc() || end != part.data() + part.size() || index > list.size())
            refuse_patch(change_.at);
        if (rest_.empty() && change_.removed) {
            if (*change_.removed > list.size() - index) refuse_patch(change_.at);
            std::vector<Item> inserted;
            value_from_json(json_, inserted, context_, change_.at);
            const auto begin = list.begin() + static_cast<std::ptrdiff_t>(index);
            const auto place = list.erase(begin, begin + static_cast<std::ptrdiff_t>(*change_.removed));
            list.insert(place, std::make_move_iterator(inserted.begin()),
                        std::make_move_iterator(inserted.end()));
            return;
        }
        if (index == list.size()) refuse_patch(change_.at);
        change(list[index]);
    }

    const Change& change_;
    JsonContext& context_;
    std::string_view rest_;
    Json json_;
};

} // namespace

void refuse_json(const std::string& member, const std::string& expected) {
    throw Errors({{{}, "", "the operation's '" + member + "' is not as it must be", "it is " + expected}});
}

void read_members(const Json& json, JsonContext& context, const std::string& path,
                  const std::function<bool(const MemberOfJson&)>& read) {
    if (!json.is_object()) refuse_json(path, "an object");
    if (++context.depth > 1000) refuse_json(path, "less deeply nested");
    for (const auto& [name, value] : json.items()) {
        const MemberOfJson member{name, value, path.empty() ? name : path + "." + name};
        const bool is_verb = path.empty() && name == "do";
        if (!read(member) && !is_verb) refuse_json(member.path, "not known: remove it");
    }
    --context.depth;
}

std::size_t choice_from_json(const Json& json, const Words& words, const std::string& member) {
    const auto found = std::find(words.begin(), words.end(), json.is_string() ? json.get<std::string>() : "");
    std::string all;
    for (const auto& word : words) all += (all.empty() ? "one of " : ", ") + word;
    if (found == words.end()) refuse_json(member, all);
    return static_cast<std::size_t>(found - words.begin());
}

Json variant_to_json(const Operation& operation, JsonContext& context) {
    Json json = {{"do", verbs.at(operation.index())}};
    std::visit([&](const auto& known) { json.update(value_to_json(known, context)); }, operation);
    return json;
}

Operation variant_from_json(const Json& json, JsonContext& context) {
    const std::string verb = json.is_object() && json.contains("do") && json["do"].is_string()
                                 ? json["do"].get<std::string>()
                                 : std::string();
    const auto found = std::find(verbs.begin(), verbs.end(), verb);
    if (found == verbs.end())
        throw Errors({{{}, "", "there is no operation '" + verb + "'", name_remedy(verb, verbs)}});
    Operation operation = make(static_cast<std::size_t>(found - verbs.begin()));
    std::visit([&](auto& known) { value_from_json(json, known, context, ""); }, operation);
    return operation;
}

std::string to_json(const Operation& operation) {
    JsonContext context;
    return variant_to_json(operation, context).dump();
}

Operation operation_from_json(std::string_view text) {
    const Json json = Json::parse(text, nullptr, false);
    if (json.is_discarded())
        throw Errors(
            {{{}, "", "the operation is no JSON", "write {\"do\": \"rename\", \"path\": ..., ...}"}});
    JsonContext context;
    return variant_from_json(json, context);
}

Patch difference(const Model& before, const Model& after) {
    Patch patch;
    JsonContext context{.file = after.where.file, .files = &patch.files};
    Differences differences(context);
    differences.add(before, after, "");
    patch.changes = std::move(differences.changes);
    return patch;
}

void apply_patch(Model& model, const Patch& patch) {
    auto files = patch.files;
    JsonContext context{.file = model.where.file, .files = &files};
    for (const Change& change : patch.changes) Patching(change, context).change(model);
}

bool operator==(const Model& a, const Model& b) { return are_equal(a, b, false); }
bool operator==(const System& a, const System& b) { return are_equal(a, b, false); }
bool operator==(const Block& a, const Block& b) { return are_equal(a, b, false); }

} // namespace bf::model
