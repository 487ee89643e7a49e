"""package.py BF: a package of bf deploy runs blocks of ROS 2 where neither ROS 2 nor this build is seen. Exit code 77 where this cannot be tried."""
import pathlib
import subprocess
import sys
import tempfile

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[3] / "examples"))
import alone

bf = pathlib.Path(sys.argv[1]).resolve()
if not alone.enter_network_of_our_own():
    sys.exit(77)
MODEL = """model: packed
plugins: [Ros2]
step: 0.01
inputs: {u: {shape: [4, 4]}, v: {}}
blocks:
  node: {block: Ros2/Node}
  life: {block: Ros2/Lifecycle, begin: active}
  heard: {block: Ros2/Subscribe, type: sensor_msgs/msg/Imu}
  told: {block: Ros2/Publish, topic: told, type: geometry_msgs/msg/Twist}
  pose: {block: Ros2/SubscribeTransform}
  tf: {block: Ros2/PublishTransforms}
  call: {block: Ros2/Call, type: std_srvs/srv/SetBool}
connections: {u: tf.base, v: call.call}
"""
with tempfile.TemporaryDirectory() as folder:
    model, package = pathlib.Path(folder) / "packed.yaml", pathlib.Path(folder) / "package"
    model.write_text(MODEL)
    subprocess.run([bf, "deploy", model, "-o", package], check=True)
    words = [package / "run", "--quiet", "--priority", "0", "--stop", "0.5", "--ros2", "/packed"]
    subprocess.run(words, env={"PATH": "/usr/bin:/bin"}, cwd="/", preexec_fn=lambda: alone.hide(bf), check=True)
