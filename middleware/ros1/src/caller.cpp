#include "caller.hpp"

#include "master.hpp"

#include <ros/connection.h>
#include <ros/network.h>
#include <ros/service_manager.h>

namespace bf::ros1 {

bool Caller::has_server() noexcept {
    constexpr double between = 0.05; // s
    if (link_ && link_->isValid()) return true;
    if (is_over_ || middleware::now() - asked_ < between) return false;
    asked_ = middleware::now();
    try {
        XmlRpc::XmlRpcValue arguments;
        arguments[0] = ros::this_node::getName();
        arguments[1] = name_;
        // roscpp would wait for a master that does not answer for ever.
        auto uri = ask({ros::master::getHost(), ros::master::getPort()}, "lookupService", arguments, 1,
                       Asked::also_behind_an_interrupt);
        Address its{};
        // The master knows the services of programs that were killed, too.
        if (!uri || !ros::network::splitURI(static_cast<std::string>(*uri), its.host, its.port) ||
            is_refused(its))
            return false;
        auto link =
            ros::ServiceManager::instance()->createServiceServerLink(name_, true, type_.md5, type_.md5, {});
        const std::lock_guard lock(mutex_);
        if (is_over_ && link) link->getConnection()->drop(ros::Connection::Destructing);
        link_ = std::move(link);
        return link_ != nullptr;
    } catch (const std::exception&) { // what the master says is no address
        return false;
    } catch (const XmlRpc::XmlRpcException&) { // nor a text
        return false;
    }
}

const Message* Caller::call(const Message& request) noexcept {
    if (!link_) return nullptr;
    try {
        Raw raw;
        type_.request->encode(request, raw.bytes);
        ros::SerializedMessage answer;
        if (!link_->call(ros::serialization::serializeMessage(raw), answer)) return nullptr;
        ros::serialization::deserializeMessage(answer, answered_);
        type_.response->decode(answered_.bytes, *answer_);
        return answer_.get();
    } catch (const std::exception&) { // it is of another type
        return nullptr;
    }
}

void Caller::break_off() noexcept {
    const std::lock_guard lock(mutex_);
    is_over_ = true;
    if (link_) link_->getConnection()->drop(ros::Connection::Destructing);
}

} // namespace bf::ros1
