#include "texts.hpp"

#include <cctype>
#include <vector>

namespace bf::codegen {

namespace {

struct Text {
    std::string_view name, content;
};
using namespace std::string_view_literals;
constexpr Text texts[] = {
#include "texts.inc"
};

bool is_word(char c) { return std::isalnum(static_cast<unsigned char>(c)) || c == '_'; }

/// Where each structure is defined.
std::map<std::string, std::string, std::less<>> find_all_kernels() {
    std::map<std::string, std::string, std::less<>> kernels;
    for (const auto& text : texts) {
        const auto& source = text.content;
        for (auto at = source.find("struct "); at != std::string_view::npos;
             at = source.find("struct ", at + 1)) {
            auto end = at + 7;
            while (end < source.size() && is_word(source[end])) ++end;
            const std::string name(source.substr(at + 7, end - at - 7));
            const auto definition = source.substr(end, source.find("\n};", end) - end);
            if (definition.find('{') != std::string_view::npos) kernels.emplace(name, text.name);
        }
    }
    return kernels;
}

} // namespace

const std::string* header_of_kernel(std::string_view printed_name) {
    static const auto kernels = find_all_kernels();
    constexpr std::string_view space = "bf::kernels::";
    if (!printed_name.starts_with(space)) return nullptr;
    auto name = printed_name.substr(space.size());
    std::size_t end = 0;
    while (end < name.size() && is_word(name[end])) ++end;
    const auto found = kernels.find(name.substr(0, end));
    return found == kernels.end() ? nullptr : &found->second;
}

std::string_view text_of_header(std::string_view header) {
    for (const auto& text : texts)
        if (text.name == header) return text.content;
    return {};
}

void add_header(const std::string& header, Files& files) {
    if (files.contains("include/" + header)) return;
    const std::string_view text = text_of_header(header);
    if (text.empty()) return;
    files["include/" + header] = std::string(text);
    add_headers_of(text, files);
}

void add_headers_of(std::string_view text, Files& files) {
    constexpr std::string_view include = "#include \"";
    for (auto at = text.find(include); at != std::string_view::npos; at = text.find(include, at + 1)) {
        const auto begin = at + include.size();
        add_header(std::string(text.substr(begin, text.find('"', begin) - begin)), files);
    }
}

} // namespace bf::codegen
