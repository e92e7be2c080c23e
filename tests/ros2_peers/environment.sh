# To be sourced with the path of an environment: what its programs need to find ROS 2 (rclpy sets the same for itself
# by starting twice; compilers, and tests that count processes, need it beforehand).
_prefix=$1
_libraries=$_prefix/lib
for _folder in "$_prefix"/lib/python3.*/site-packages/ros_*.libs; do
    _libraries=$_libraries:$_folder
done
export LD_LIBRARY_PATH=$_libraries
export AMENT_PREFIX_PATH=$_prefix
export _ROS_WHEELS_BOOTSTRAP_COMPLETE=1
unset _prefix _libraries _folder
