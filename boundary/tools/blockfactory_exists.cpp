// blockfactory-exists PLUGIN BLOCK: exit status 0 when a factory for that pair loads, else 1.
#include "BlockFactory/Core/Block.h"
#include "BlockFactory/Core/FactorySingleton.h"

#include <iostream>

int main(int argc, char** argv) {
    using namespace blockfactory::core;
    if (argc != 3) {
        std::cerr << "usage: blockfactory-exists PLUGIN BLOCK\n"
                     "Tells whether the plugin, searched in BLOCKFACTORY_PLUGIN_PATH, has the block.\n"
                     "Example: blockfactory-exists WholeBodyToolbox MassMatrix\n";
        return 1;
    }
    if (ClassFactorySingleton::getInstance().getClassFactory({argv[1], argv[2]})) return 0;
    std::cerr << Log::getSingleton().getErrors();
    return 1;
}
