#include "files.hpp"

#include "bf/base/files.hpp"

#include <algorithm>

namespace bf::service {

namespace fs = std::filesystem;

std::string relative_to(const fs::path& folder, const fs::path& file) {
    const std::string text = file.lexically_relative(folder).generic_string();
    return text.empty() ? file.generic_string() : text;
}

std::vector<std::string> files_in(const fs::path& folder, const char* ending) {
    std::vector<std::string> found;
    constexpr int deepest = 6;
    std::error_code error;
    for (auto at =
             fs::recursive_directory_iterator(folder, fs::directory_options::skip_permission_denied, error);
         !error && at != fs::recursive_directory_iterator() && found.size() < 1000; at.increment(error)) {
        const std::string name = at->path().filename().string();
        if (at->is_directory(error) && (at.depth() >= deepest || name.starts_with(".") || name == "build"))
            at.disable_recursion_pending();
        if (at->path().extension() == ending && at->is_regular_file(error) && is_inside(at->path(), folder))
            found.push_back(relative_to(folder, at->path()));
    }
    std::sort(found.begin(), found.end());
    return found;
}

} // namespace bf::service
