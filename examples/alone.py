"""Programs that see neither the networks nor what is installed."""
import ctypes
import fcntl
import os
import pathlib
import socket
import struct

libc = ctypes.CDLL(None)
new_user, new_network, new_mounts, private = 0x10000000, 0x40000000, 0x20000, 0x44000


def enter_network_of_our_own():
    """Ports of YARP listen to everybody, and nodes of ROS 2 hear all of their domain, so this program and its children get a network that ends at this computer."""
    if libc.unshare(new_network) != 0 and libc.unshare(new_user | new_network) != 0:
        return False
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as any_socket:
        set_flags, up_and_running = 0x8914, 0x41
        fcntl.ioctl(any_socket, set_flags, struct.pack("16sh14x", b"lo", up_and_running))
    return True


def hide(bf):
    """For this process, before it runs another program: empty folders in place of this build and of the libraries that scripts/deps has installed, where the system allows that."""
    if libc.unshare(new_mounts) != 0 or libc.mount(b"none", b"/", None, private, None) != 0:
        return
    for folder in (pathlib.Path(__file__).resolve().parents[1] / ".deps", bf.parents[1] / "lib", bf.parent):
        if libc.mount(b"none", str(folder.resolve()).encode(), b"tmpfs", 0, None) != 0:
            os._exit(1)
