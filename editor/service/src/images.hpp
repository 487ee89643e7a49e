#pragma once

#include "bf/view/drawing.hpp"

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace bf::service {

/// The images of drawings: pages ask for them by the numbers that they are told, never by the name of a file.
class Images {
  public:
    explicit Images(std::filesystem::path folder) : folder_(std::move(folder)) {}

    /// The drawing with "images/3.png" instead of each file.
    editor::Drawing addressed(editor::Drawing drawing);
    /// Of "3.png"; nothing where there is none that may be shown, see editor::image_defect.
    std::optional<std::string> read(std::string_view which) const;

  private:
    std::filesystem::path folder_;
    std::vector<std::filesystem::path> files_;
};

} // namespace bf::service
