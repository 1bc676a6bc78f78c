// What Gazebo Sim declares and a system of this kind uses, with the documented signatures.
#pragma once
#include <chrono>
#include <cstdint>
#include <iostream>
#include <map>
#include <memory>
#include <string>
#include <typeindex>
#include <utility>
#include <vector>

#define gzerr std::cerr
#define GZ_ADD_PLUGIN(...)

namespace sdf
{
class Element
{
 public:
  std::map<std::string, std::string> texts;
  template <typename T>
  std::pair<T, bool> Get(const std::string &key, const T &otherwise) const
  {
    const auto found = texts.find(key);
    if (found == texts.end()) return {otherwise, false};
    if constexpr (std::is_same_v<T, std::string>) return {found->second, true};
    else return {static_cast<T>(std::stod(found->second)), true};
  }
};
}  // namespace sdf

namespace gz::sim
{
using Entity = std::uint64_t;
inline const Entity kNullEntity{0};
class EventManager {};
struct UpdateInfo
{
  std::chrono::steady_clock::duration simTime{0};
  std::chrono::steady_clock::duration dt{0};
  bool paused{false};
};
struct AnyComponent { virtual ~AnyComponent() = default; };
template <int Tag>
class Numbers : public AnyComponent
{
 public:
  Numbers() = default;
  explicit Numbers(std::vector<double> data) : data_(std::move(data)) {}
  std::vector<double> &Data() { return data_; }

 private:
  std::vector<double> data_;
};
namespace components
{
using JointPosition = Numbers<1>;
using JointVelocity = Numbers<2>;
using JointForceCmd = Numbers<3>;
}  // namespace components
class EntityComponentManager
{
 public:
  std::map<std::string, Entity> joints;
  template <typename T>
  T *Component(Entity entity)
  {
    const auto found = held_.find({entity, std::type_index(typeid(T))});
    return found == held_.end() ? nullptr : static_cast<T *>(found->second.get());
  }
  template <typename T>
  T *CreateComponent(Entity entity, T data)
  {
    held_[{entity, std::type_index(typeid(T))}] = std::make_unique<T>(std::move(data));
    return Component<T>(entity);
  }

 private:
  std::map<std::pair<Entity, std::type_index>, std::unique_ptr<AnyComponent>> held_;
};
class Model
{
 public:
  explicit Model(Entity entity) : entity_(entity) {}
  Entity JointByName(const EntityComponentManager &ecm, const std::string &name) const
  {
    const auto found = ecm.joints.find(name);
    return entity_ == kNullEntity || found == ecm.joints.end() ? kNullEntity : found->second;
  }

 private:
  Entity entity_;
};
class System { public: virtual ~System() = default; };
class ISystemConfigure
{
 public:
  virtual ~ISystemConfigure() = default;
  virtual void Configure(const Entity &, const std::shared_ptr<const sdf::Element> &,
                         EntityComponentManager &, EventManager &) = 0;
};
class ISystemPreUpdate
{
 public:
  virtual ~ISystemPreUpdate() = default;
  virtual void PreUpdate(const UpdateInfo &, EntityComponentManager &) = 0;
};
class ISystemReset
{
 public:
  virtual ~ISystemReset() = default;
  virtual void Reset(const UpdateInfo &, EntityComponentManager &) = 0;
};
}  // namespace gz::sim
