// What ros2_control declares and a chainable controller uses, with the documented signatures.
#pragma once
#include <cstdio>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#define RCLCPP_ERROR(logger, ...) ((void)(logger), std::fprintf(stderr, __VA_ARGS__))
#define PLUGINLIB_EXPORT_CLASS(type, base)

namespace rclcpp
{
class Time {};
class Duration {};
class Logger {};
class Parameter
{
public:
  std::string text;
  double number = 0.0;
  std::string as_string() const {return text;}
  double as_double() const {return number;}
};
}  // namespace rclcpp

namespace rclcpp_lifecycle
{
class State {};
class LifecycleNode
{
public:
  std::map<std::string, rclcpp::Parameter> parameters;
  const char * get_name() const {return "front";}
  rclcpp::Logger get_logger() const {return {};}
  rclcpp::Parameter get_parameter(const std::string & name) const {return parameters.at(name);}
};
}  // namespace rclcpp_lifecycle

namespace hardware_interface
{
constexpr char HW_IF_POSITION[] = "position";
constexpr char HW_IF_VELOCITY[] = "velocity";
constexpr char HW_IF_EFFORT[] = "effort";
class CommandInterface
{
public:
  CommandInterface(const std::string & prefix, const std::string & name, double * value)
  : name(prefix + "/" + name), value(value) {}
  std::string name;
  double * value;
};
class LoanedCommandInterface
{
public:
  double held = 0.0;
  template<typename T>
  [[nodiscard]] bool set_value(const T & value) {held = value; return true;}
};
class LoanedStateInterface
{
public:
  std::optional<double> held;
  [[nodiscard]] std::optional<double> get_optional() const {return held;}
};
}  // namespace hardware_interface

namespace controller_interface
{
enum class CallbackReturn {SUCCESS, FAILURE, ERROR};
enum class return_type {OK, ERROR};
enum class interface_configuration_type {ALL, INDIVIDUAL, NONE};
struct InterfaceConfiguration
{
  interface_configuration_type type;
  std::vector<std::string> names;
};
class ChainableControllerInterface
{
public:
  virtual ~ChainableControllerInterface() = default;
  virtual InterfaceConfiguration command_interface_configuration() const = 0;
  virtual InterfaceConfiguration state_interface_configuration() const = 0;
  virtual CallbackReturn on_init() = 0;
  virtual CallbackReturn on_configure(const rclcpp_lifecycle::State &) = 0;
  virtual CallbackReturn on_activate(const rclcpp_lifecycle::State &) = 0;
  virtual CallbackReturn on_deactivate(const rclcpp_lifecycle::State &) = 0;
  std::vector<hardware_interface::CommandInterface> export_reference_interfaces()
  {
    return on_export_reference_interfaces();
  }
  bool set_chained_mode(bool chained_mode) {return on_set_chained_mode(chained_mode);}
  unsigned int get_update_rate() const {return update_rate;}
  std::shared_ptr<rclcpp_lifecycle::LifecycleNode> get_node() const {return node;}
  return_type update(const rclcpp::Time & time, const rclcpp::Duration & period)
  {
    return update_and_write_commands(time, period);
  }

  unsigned int update_rate = 1000;
  std::vector<hardware_interface::LoanedCommandInterface> command_interfaces_;
  std::vector<hardware_interface::LoanedStateInterface> state_interfaces_;

protected:
  virtual std::vector<hardware_interface::CommandInterface> on_export_reference_interfaces() = 0;
  virtual bool on_set_chained_mode(bool chained_mode) = 0;
  virtual return_type update_reference_from_subscribers(
    const rclcpp::Time &, const rclcpp::Duration &) = 0;
  virtual return_type update_and_write_commands(
    const rclcpp::Time &, const rclcpp::Duration &) = 0;
  template<typename T>
  void auto_declare(const std::string & name, const T & value)
  {
    if constexpr (std::is_same_v<T, double>) {node->parameters[name].number = value;}
    else {node->parameters[name].text = value;}
  }
  std::vector<double> reference_interfaces_;

private:
  std::shared_ptr<rclcpp_lifecycle::LifecycleNode> node =
    std::make_shared<rclcpp_lifecycle::LifecycleNode>();
};
}  // namespace controller_interface
