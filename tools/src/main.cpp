// The `bf` command.
#include "command.hpp"

int main(int argc, char** argv) { return bf::tools::command(argc, argv); }
