// Runs the generated model as the public controllers' drivers do.
#include "TestModel.h"

#include <BlockFactory/SimulinkCoder/GeneratedCodeWrapper.h>

int main() {
    blockfactory::coder::GeneratedCodeWrapper<TestModelModelClass> model = {"TestModel", 2};
    bool good = model.initialize();
    for (int step = 0; good && step < 10; ++step) good = model.step();
    std::cerr << model.getErrors() << std::endl;
    return model.terminate() && good ? 0 : 1;
}
