// An engine of 2019 that opens plugins itself. engine2019 FILE
#include <BlockFactory/Core/Block.h>
#include <shlibpp/SharedLibrary.h>
#include <shlibpp/SharedLibraryClass.h>
#include <shlibpp/SharedLibraryClassFactory.h>
#include <shlibpp/SharedLibraryFactory.h>

#include <iostream>

int main(int, char** argv) {
    using blockfactory::core::Block;
    shlibpp::SharedLibraryClassFactory<Block> factory(argv[1], "Label");
    shlibpp::SharedLibraryClassFactory<Block> own(argv[1], 1234, 4321, 7, "OwnLabel");
    shlibpp::SharedLibraryClassFactory<Block> wrong(argv[1], "OwnLabel");
    std::cerr << factory.getError() << own.getError();
    shlibpp::SharedLibraryClass<Block> block(factory), own_block(own);
    return block.isValid() && own_block.isValid() && block->numberOfParameters() == 3 && !wrong.isValid() ? 0
                                                                                                          : 1;
}
