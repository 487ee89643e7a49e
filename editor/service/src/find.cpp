#include "find.hpp"

#include "bf/model/edit.hpp"

#include <algorithm>
#include <cctype>

namespace bf::service {

namespace {

constexpr std::size_t most_hits = 200;

class Finder {
  public:
    explicit Finder(const std::string& text) : wanted_(lower(text)) {}

    void look_into(const model::System& system, const std::string& path) {
        for (const auto* ports : {&system.inputs, &system.outputs})
            for (const auto& port : *ports) {
                const std::string at = model::joined(path, port.name);
                look(names_, port.name, {at, ports == &system.inputs ? "input" : "output", port.doc});
                look(texts_, port.doc, {at, "doc", port.doc});
            }
        for (const auto& signal : system.signals) // found where it comes from
            look(names_, signal.name,
                 {model::joined(path, signal.of.block.empty() ? signal.of.port : signal.of.block), "signal",
                  signal.name + " = " + signal.of.text()});
        variables(system.variables, path, "");
    }

    void look_at(const model::Block& block, const std::string& path) {
        look(names_, block.name, {path, "name", block.is_library_block() ? block.type : "subsystem"});
        look(types_, block.type, {path, "type", block.type});
        look(texts_, block.doc, {path, "doc", block.doc});
        for (const auto& setting : block.settings) setting_of(path, setting.name, setting.value.matlab());
        if (block.when) setting_of(path, "when", block.when->matlab());
        if (block.period) setting_of(path, "period", block.period->matlab());
        if (block.reference) setting_of(path, "file", block.reference->file);
    }

    Hits hits() {
        Hits all;
        for (auto* list : {&names_, &types_, &texts_})
            all.hits.insert(all.hits.end(), list->begin(), list->end());
        if (all.hits.size() > most_hits) all.hits.resize(most_hits);
        return all;
    }

  private:
    static std::string lower(std::string text) {
        std::ranges::transform(text, text.begin(), [](unsigned char c) { return std::tolower(c); });
        return text;
    }

    void look(std::vector<Hit>& list, const std::string& in, const Hit& hit) {
        if (list.size() < most_hits && lower(in).find(wanted_) != std::string::npos) list.push_back(hit);
    }

    void setting_of(const std::string& path, const std::string& name, const std::string& value) {
        look(texts_, name + " = " + value, {path, "setting", name + " = " + value.substr(0, 200)});
    }

    void variables(const std::vector<model::Variable>& list, const std::string& path,
                   const std::string& prefix) {
        for (const auto& variable : list) {
            if (!variable.fields.empty()) {
                variables(variable.fields, path, prefix + variable.name + ".");
                continue;
            }
            const std::string text = prefix + variable.name + " = " + variable.value.matlab();
            look(texts_, text + " " + variable.doc, {path, "variable", text.substr(0, 200)});
        }
    }

    const std::string wanted_;
    std::vector<Hit> names_, types_, texts_;
};

} // namespace

Hits found_in(const model::Model& model, const std::string& text) {
    if (text.empty()) return {};
    Finder finder(text);
    finder.look_into(model.root, "");
    model::walk(model, [&](const std::string& path, const model::Block& block) {
        finder.look_at(block, path);
        if (const model::System* content = block.content()) finder.look_into(*content, path);
    });
    return finder.hits();
}

} // namespace bf::service
