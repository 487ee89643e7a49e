// The text that a model was read from, with what has changed.
#include "bf/formats/yaml.hpp"
#include "printer.hpp"

#include <utility>

namespace bf::formats {

namespace {

/// The text with the line ends, byte order mark and missing last line end of the one before.
std::string in_form_of(const std::string& raw, std::string text) {
    if (raw.find("\r\n") != raw.npos) {
        std::string lines;
        for (const char c : text) lines += c == '\n' ? "\r\n" : std::string(1, c);
        text = std::move(lines);
    }
    if (!raw.ends_with('\n') && text.ends_with('\n')) text.erase(text.find_last_not_of("\r\n") + 1);
    return (raw.starts_with("\xef\xbb\xbf") ? "\xef\xbb\xbf" : "") + text;
}

void forget_references(model::System& system) {
    for (model::Block& block : system.blocks) {
        if (block.reference) block.reference->model.reset();
        if (block.system) forget_references(*block.system);
    }
}

std::string name_of(const model::Model& model) { return model.where.file ? *model.where.file : "model.yaml"; }

} // namespace

/// What a model was read from.
struct Rewriter::Reading {
    explicit Reading(const model::Model& model)
        : raw(model.source), source(*model.source, name_of(model)), before(read_alone(source, root)) {
        if (before && root.is_map() && !root.flow)
            old = content_of(*before);
        else
            before.reset();
    }
    Reading(const Reading&) = delete;
    Reading& operator=(const Reading&) = delete;

    const std::shared_ptr<const std::string> raw;
    const Source source;
    Node root;
    std::optional<model::Model> before; ///< none: nothing can be changed in that text
    Content old;
};

std::optional<Rewriter::Written> Rewriter::edited(const Reading& reading, const model::Model& model) {
    if (!reading.before) return {};
    model::Model wanted = model;
    forget_references(wanted.root);
    if (*reading.before == wanted)
        return Written{*reading.raw, std::make_shared<const model::Model>(*reading.before)};
    const Content now = content_of(model);
    Base base(reading.source, reading.root, reading.old, now, model.where.file);
    Printer printer(&base);
    for (const Item& item : now.items) printer.print(item, 0, &base.root);
    printer.print_rest(base.root, 0);
    printer.text += base.text(base.root.end, base.text().size());
    const Source written(printer.text, name_of(model));
    Node ignored;
    auto after = read_alone(written, ignored);
    if (!after || !(*after == wanted)) return {};
    return Written{in_form_of(*reading.raw, std::move(printer.text)),
                   std::make_shared<const model::Model>(std::move(*after))};
}

Rewriter::Rewriter() = default;
Rewriter::~Rewriter() = default;

Rewriter::Written Rewriter::write(const model::Model& model) {
    if (model.source && (!reading_ || reading_->raw != model.source))
        reading_ = std::make_unique<Reading>(model);
    if (model.source)
        if (auto written = edited(*reading_, model)) return std::move(*written);
    std::string text = canonical_yaml(model);
    Node ignored;
    auto after = read_alone(Source(text, name_of(model)), ignored);
    return {std::move(text), std::make_shared<const model::Model>(after ? std::move(*after) : model)};
}

std::optional<std::string> edited_yaml(const model::Model& model) {
    auto written = Rewriter::edited(Rewriter::Reading(model), model);
    if (!written) return {};
    return std::move(written->text);
}

} // namespace bf::formats
