// The block as plugins write it for every engine.
#ifndef BLOCKFACTORY_CORE_BLOCK_H
#define BLOCKFACTORY_CORE_BLOCK_H

#include "BlockFactory/Core/Parameters.h"

#include <string>
#include <vector>

namespace blockfactory {
namespace core {
class Block;
class BlockInformation;
} // namespace core
} // namespace blockfactory

/// An engine makes a first object for configureSizeAndPorts and destroys it; a second one runs: initialize,
/// initializeInitialConditions, output (and updateDiscreteState) at each step, terminate. A method that
/// returns false has logged why.
class blockfactory::core::Block {
  public:
    /// Parameters 0 and 1 are the class and the library of the block.
    static constexpr unsigned NumberOfParameters = 2;

    Block() = default;
    virtual ~Block() = default;

    /// How many parameters a model gives; subclasses add theirs.
    virtual unsigned numberOfParameters();
    virtual std::vector<std::string> additionalBlockOptions();
    virtual unsigned numberOfDiscreteStates();
    virtual unsigned numberOfContinuousStates();
    virtual bool updateDiscreteState(const BlockInformation* blockInfo);
    virtual bool stateDerivative(const BlockInformation* blockInfo);
    virtual bool parameterAtIndexIsTunable(unsigned index);

    /// Declares className and libName and reads them. An override declares and reads only its own.
    virtual bool parseParameters(BlockInformation* blockInfo);
    bool getParameters(Parameters& params) const;

    /// Declares ports. Nothing else in the object survives.
    virtual bool configureSizeAndPorts(BlockInformation* blockInfo);
    /// Reads parameters and sizes; the place to allocate.
    virtual bool initialize(BlockInformation* blockInfo);
    virtual bool initializeInitialConditions(const BlockInformation* blockInfo);
    virtual bool output(const BlockInformation* blockInfo) = 0;
    virtual bool terminate(const BlockInformation* blockInfo);

    /// The path of the block; empty, and an error, when the engine has none.
    std::string getUniqueName(const BlockInformation* blockInfo) const;

  protected:
    Parameters m_parameters;
};

#endif
