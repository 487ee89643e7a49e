// models OUTPUT PARTS: writes all cases, see write_models.
#include "write_models.hpp"

#include <exception>
#include <iostream>
#include <string>

int main(int, char** arguments) try {
    using namespace bf::codegen::test;
    write_models(families(), arguments[1], std::stoul(arguments[2]));
} catch (const std::exception& error) {
    std::cerr << error.what() << "\n";
    return 1;
}
