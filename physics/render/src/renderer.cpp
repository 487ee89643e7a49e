#include "bf/physics/renderer.hpp"
