#!/bin/sh
# The first process of the guest: makes the rig, runs its tests, turns the machine off. What is said here, run.sh reads.
export PATH=/bin HOME=/root TMPDIR=/tmp
/bin/busybox --install -s /bin

end() {
  echo "EXIT $1"
  sync
  poweroff -f
}

mount -t devtmpfs dev /dev
mkdir -p /dev/pts /dev/shm
mount -t proc proc /proc
mount -t sysfs sys /sys
mount -t devpts devpts /dev/pts
for folder in /tmp /run /dev/shm; do mount -t tmpfs tmpfs $folder; done
mkdir /run/lock
chmod 1777 /tmp /dev/shm /run/lock
dmesg -n 1 # the kernel's messages would cut our lines in two; `dmesg` has them all

# One camera, one output whose frames the camera can be made to see: bits 0 (capture) and 8 (output), both HDMI.
# A test that loads vivid anew reads the parameters here.
echo "n_devs=1 node_types=0x101 num_inputs=1 input_types=0x3 num_outputs=1 output_types=0x1" > /etc/vivid-parameters
while read -r module; do
  parameters=
  [ "$module" != vivid ] || parameters=$(cat /etc/vivid-parameters)
  # shellcheck disable=SC2086 # each parameter is a word
  insmod "/mod/$module.ko" $parameters || echo "MISSING module $module"
done < /mod/order

for device in /dev/video0 /dev/ttyUSB0; do
  tries=0
  until [ -c $device ]; do
    tries=$((tries + 1))
    if [ $tries -gt 600 ]; then
      echo "MISSING $device"
      dmesg | tail -n 40
      end 1
    fi
    sleep 0.1
  done
done

# Where udev, which is not here, would put the camera's lasting names.
mkdir -p /dev/v4l/by-id /dev/v4l/by-path
ln -s ../../video0 /dev/v4l/by-path/platform-vivid.0-video-index0
ln -s ../../video0 /dev/v4l/by-id/virtual-vivid-000-video-index0

read -r uptime _ < /proc/uptime
echo "UP $uptime"
filter=$(cat /etc/filter)
EPIRIG_VIRTUAL_RIG=1 EPIRIG_PROGRAM=/bin/epirig virtual_rig --test-threads 1 --nocapture ${filter:+"$filter"}
end $?
