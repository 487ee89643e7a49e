#include "BlockFactory/Core/Block.h"

#include "BlockFactory/Core/BlockInformation.h"
#include "BlockFactory/Core/Log.h"

namespace blockfactory::core {

constexpr unsigned Block::NumberOfParameters;

unsigned Block::numberOfParameters() { return NumberOfParameters; }
std::vector<std::string> Block::additionalBlockOptions() { return {}; }
unsigned Block::numberOfDiscreteStates() { return 0; }
unsigned Block::numberOfContinuousStates() { return 0; }
bool Block::updateDiscreteState(const BlockInformation*) { return true; }
bool Block::stateDerivative(const BlockInformation*) { return true; }
bool Block::parameterAtIndexIsTunable(unsigned) { return false; }

bool Block::parseParameters(BlockInformation* blockInfo) {
    if (!blockInfo->addParameterMetadata({ParameterType::STRING, 0, 1, 1, "className"}) ||
        !blockInfo->addParameterMetadata({ParameterType::STRING, 1, 1, 1, "libName"})) {
        bfError << "Failed to declare the parameters className and libName.";
        return false;
    }
    return blockInfo->parseParameters(m_parameters);
}

bool Block::getParameters(Parameters& params) const {
    params = m_parameters;
    return true;
}

bool Block::configureSizeAndPorts(BlockInformation* blockInfo) { return Block::parseParameters(blockInfo); }
bool Block::initialize(BlockInformation* blockInfo) { return Block::parseParameters(blockInfo); }
bool Block::initializeInitialConditions(const BlockInformation*) { return true; }
bool Block::terminate(const BlockInformation*) { return true; }

std::string Block::getUniqueName(const BlockInformation* blockInfo) const {
    std::string name;
    if (blockInfo->getUniqueName(name)) return name;
    bfError << "The engine gave no name for this block.";
    return {};
}

} // namespace blockfactory::core
