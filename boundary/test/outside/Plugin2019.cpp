// A plugin in the words of BlockFactory 0.8: the library of plugins is called shlibpp. Label y = u + the
// length of text.
#include <BlockFactory/Core/Block.h>
#include <BlockFactory/Core/BlockInformation.h>
#include <BlockFactory/Core/Log.h>
#include <BlockFactory/Core/Parameter.h>
#include <BlockFactory/Core/Port.h>
#include <BlockFactory/Core/Signal.h>
#include <shlibpp/SharedLibraryClassApi.h>

using namespace blockfactory::core;

namespace older {

class Label : public Block {
  public:
    static const unsigned NumberOfParameters;
    unsigned numberOfParameters() override { return NumberOfParameters; }
    bool parseParameters(BlockInformation* blockInfo) override {
        const ParameterMetadata text(ParameterType::STRING, Block::NumberOfParameters, 1, 1, "text");
        return blockInfo->addParameterMetadata(text) && blockInfo->parseParameters(m_parameters);
    }
    bool configureSizeAndPorts(BlockInformation* blockInfo) override {
        if (!Block::initialize(blockInfo)) return false;
        const Port::Info scalar{0, {1}, Port::DataType::DOUBLE};
        return blockInfo->setPortsInfo({scalar}, {scalar});
    }
    bool initialize(BlockInformation* blockInfo) override {
        return Block::initialize(blockInfo) && parseParameters(blockInfo) &&
               m_parameters.getParameter("text", text_);
    }
    bool output(const BlockInformation* blockInfo) override {
        const InputSignalPtr u = blockInfo->getInputPortSignal(0);
        const OutputSignalPtr y = blockInfo->getOutputPortSignal(0);
        if (!u || !y) bfError << "A port has no signal.";
        return u && y && y->set(0, u->get<double>(0) + static_cast<double>(text_.size()));
    }

  private:
    std::string text_;
};
const unsigned Label::NumberOfParameters = Block::NumberOfParameters + 1;

} // namespace older

SHLIBPP_DEFINE_SHARED_SUBCLASS(Label, older::Label, blockfactory::core::Block);
SHLIBPP_DEFINE_SHARED_SUBCLASS_CUSTOM(1234, 4321, 7, OwnLabel, older::Label, blockfactory::core::Block);
