#include "images.hpp"

#include "bf/base/files.hpp"
#include "bf/view/image.hpp"

#include <algorithm>

namespace bf::service {

editor::Drawing Images::addressed(editor::Drawing drawing) {
    for (auto& element : drawing.elements)
        for (auto& shape : element.shapes) {
            if (shape.kind != editor::Shape::Kind::image) continue;
            const std::filesystem::path file = shape.text;
            auto found = std::ranges::find(files_, file);
            if (found == files_.end()) found = files_.insert(files_.end(), file);
            shape.text = "images/" + std::to_string(found - files_.begin()) + file.extension().string();
        }
    return drawing;
}

std::optional<std::string> Images::read(std::string_view which) const {
    for (std::size_t i = 0; i < files_.size(); ++i)
        if (which == std::to_string(i) + files_[i].extension().string() &&
            editor::image_defect(files_[i], folder_).empty())
            return read_text_file(files_[i], editor::largest_image);
    return {};
}

} // namespace bf::service
