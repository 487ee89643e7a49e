// A plugin written against the paper's API alone, as in its documentation, in C++14.
#pragma once

#include <BlockFactory/Core/Block.h>
#include <BlockFactory/Core/BlockInformation.h>
#include <BlockFactory/Core/Log.h>
#include <BlockFactory/Core/Parameter.h>
#include <BlockFactory/Core/Parameters.h>
#include <BlockFactory/Core/Port.h>
#include <BlockFactory/Core/Signal.h>

#include <memory>
#include <string>
#include <vector>

namespace legacy_test {

namespace core = blockfactory::core;

/// y = factor * (u1 + u2) + offset + steps, sizes open; the number of steps is hidden state.
class Accumulate : public core::Block {
  public:
    static const unsigned NumberOfParameters;
    unsigned numberOfParameters() override { return NumberOfParameters; }
    bool parseParameters(core::BlockInformation* blockInfo) override;
    bool configureSizeAndPorts(core::BlockInformation* blockInfo) override;
    bool initialize(core::BlockInformation* blockInfo) override;
    bool initializeInitialConditions(const core::BlockInformation* blockInfo) override;
    bool output(const core::BlockInformation* blockInfo) override;
    bool updateDiscreteState(const core::BlockInformation* blockInfo) override;

  private:
    double factor_ = 0;
    std::vector<double> offset_;
    int steps_ = 0;
};

/// Gives back what it was told by parameters of all types: y = {int, bool, double, length of the text,
/// ints..., number of cells, field of a struct}.
class AllParameters : public core::Block {
  public:
    unsigned numberOfParameters() override { return core::Block::NumberOfParameters + 7; }
    bool parseParameters(core::BlockInformation* blockInfo) override;
    bool configureSizeAndPorts(core::BlockInformation* blockInfo) override;
    bool initialize(core::BlockInformation* blockInfo) override;
    bool output(const core::BlockInformation* blockInfo) override;

  private:
    std::vector<double> told_;
};

/// y = 2 u of a 2 x 3 matrix, column by column, in single precision.
class Matrices : public core::Block {
  public:
    bool configureSizeAndPorts(core::BlockInformation* blockInfo) override;
    bool output(const core::BlockInformation* blockInfo) override;
};

/// A base as those of robots: it has a struct and a text, which it declares where it is configured and where
/// it is initialised. y = gain u + the number of letters of the label.
class Labelled : public core::Block {
  public:
    static const unsigned NumberOfParameters;
    unsigned numberOfParameters() override { return NumberOfParameters; }
    bool parseParameters(core::BlockInformation* blockInfo) override;
    bool configureSizeAndPorts(core::BlockInformation* blockInfo) override;
    bool initialize(core::BlockInformation* blockInfo) override;
    bool output(const core::BlockInformation* blockInfo) override;

  protected:
    double gain_ = 0, offset_ = 0;
};

/// Leaves the base's parameters to it, and has an offset. Where it parses its own it looks at the base's.
class Offset : public Labelled {
  public:
    unsigned numberOfParameters() override { return Labelled::NumberOfParameters + 1; }
    bool parseParameters(core::BlockInformation* blockInfo) override;
    bool configureSizeAndPorts(core::BlockInformation* blockInfo) override;
    bool initialize(core::BlockInformation* blockInfo) override;
};

/// The same, but no parameter is needed to configure it. The last one that it counts it never reads.
class LateOffset : public Offset {
  public:
    unsigned numberOfParameters() override { return Labelled::NumberOfParameters + 2; }
    bool configureSizeAndPorts(core::BlockInformation* blockInfo) override;
};

/// Does what its parameter `misdeed` names: "<call> returns false", "<call> throws", "<call> throws 7",
/// "ports twice", "port index twice", "shrinks", "wrong type", "signal too early", "grows", "logs in a log".
class Misbehaves : public core::Block {
  public:
    Misbehaves();
    unsigned numberOfParameters() override { return core::Block::NumberOfParameters + 1; }
    bool parseParameters(core::BlockInformation* blockInfo) override;
    bool configureSizeAndPorts(core::BlockInformation* blockInfo) override;
    bool initialize(core::BlockInformation* blockInfo) override;
    bool initializeInitialConditions(const core::BlockInformation* blockInfo) override;
    bool output(const core::BlockInformation* blockInfo) override;
    bool updateDiscreteState(const core::BlockInformation* blockInfo) override;
    bool terminate(const core::BlockInformation* blockInfo) override;

  private:
    bool outcome(const std::string& call) const;
    bool log_in_a_log() const;
    std::string misdeed_;
};

/// y = u, the cheapest block there is: what it costs is the engine's.
class Nothing : public core::Block {
  public:
    bool configureSizeAndPorts(core::BlockInformation* blockInfo) override;
    bool output(const core::BlockInformation* blockInfo) override;
};

/// Writes down which of its objects is called how: "3 output" for the third one. Ports are known from
/// configureSizeAndPorts, parameters there are none.
class Diary : public core::Block {
  public:
    Diary();
    ~Diary() override;
    bool parseParameters(core::BlockInformation* blockInfo) override;
    bool configureSizeAndPorts(core::BlockInformation* blockInfo) override;
    bool initialize(core::BlockInformation* blockInfo) override;
    bool initializeInitialConditions(const core::BlockInformation* blockInfo) override;
    bool output(const core::BlockInformation* blockInfo) override;
    bool updateDiscreteState(const core::BlockInformation* blockInfo) override;
    bool terminate(const core::BlockInformation* blockInfo) override;

  private:
    bool note(const char* call) const;
    int number_;
};

/// Throws in its constructor.
class CannotBeMade : public core::Block {
  public:
    CannotBeMade();
    bool output(const core::BlockInformation*) override { return true; }
};

} // namespace legacy_test
