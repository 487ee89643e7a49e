#include "bf/view/place.hpp"

namespace bf::editor {

std::vector<Point> arrange(const std::vector<Box>& boxes, const std::vector<Net>&) {
    std::vector<Point> corners;
    double x = 0;
    for (const Box& box : boxes) {
        corners.push_back({x, 0});
        x += box.width + 60;
    }
    return corners;
}

} // namespace bf::editor
