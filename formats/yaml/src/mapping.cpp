#include "mapping.hpp"

#include "scalar.hpp"

#include "bf/base/escape.hpp"

namespace bf::formats {

namespace {

Content content_of(const Node& node) {
    Content content;
    switch (node.kind) {
    case Node::Kind::map:
        content.kind = Content::Kind::map;
        for (std::size_t i = 0; i + 1 < node.items.size(); i += 2)
            content.items.push_back({key_text(node.items[i].text), content_of(node.items[i + 1])});
        break;
    case Node::Kind::sequence:
        content.kind = Content::Kind::list;
        for (const Node& item : node.items) content.items.push_back({"", content_of(item)});
        break;
    case Node::Kind::null: content.kind = Content::Kind::map; break;
    case Node::Kind::scalar:
        if (node.text.find('\n') != node.text.npos && is_literal(node.text))
            return {.kind = Content::Kind::literal, .text = node.text};
        content.may_flow = is_plain(node.text, true) || !is_plain(node.text, false);
        content.text =
            is_plain(node.text, false) && !node.text.empty() ? node.text : double_quoted(node.text);
        break;
    }
    return content;
}

} // namespace

std::string json_of(const Node& node) {
    std::string json;
    switch (node.kind) {
    case Node::Kind::null: return "{}";
    case Node::Kind::scalar: return escape::python(node.text);
    case Node::Kind::sequence:
        for (const Node& item : node.items) json += (json.empty() ? "" : ", ") + json_of(item);
        return "[" + json + "]";
    case Node::Kind::map:
        for (std::size_t i = 0; i + 1 < node.items.size(); i += 2)
            json += (json.empty() ? "" : ", ") + escape::python(node.items[i].text) + ": " +
                    json_of(node.items[i + 1]);
        return "{" + json + "}";
    }
    return json;
}

bool is_mapping(const model::Expression& value) {
    return value.quotes == model::Quotes::literal && value.text.starts_with("{\"");
}

Content mapping_content(const model::Expression& value) {
    std::vector<std::pair<std::size_t, std::size_t>> quoted;
    const Source source(value.text, "");
    return content_of(parse(source, quoted));
}

} // namespace bf::formats
