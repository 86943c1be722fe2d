SUMMARY = "Driver of an FPGA accelerator for contacts and friction of rigid bodies"
DESCRIPTION = "Userspace driver for a Projected Gauss-Seidel solver in the programmable logic of a Zynq UltraScale+, with \
a software-emulated board that runs the same driver: command line tool, C library, overlays, udev rule, systemd unit."
SECTION = "support"
LICENSE = "MIT OR Apache-2.0"
LIC_FILES_CHKSUM = "file://LICENSE-MIT;md5=@md5_mit@ \
                    file://LICENSE-APACHE;md5=@md5_apache@"
DEPENDS = "dtc-native"

SRC_URI = "file://${BP}.tar.gz"

inherit cargo pkgconfig systemd useradd

# The crates of Cargo.lock, in the form that `bitbake -c update_crates` writes.
require ${BPN}-crates.inc

# Interfaces with the version 0 may change with every version of the package.
ZPGS_ABI = "@abi@"

SYSTEMD_SERVICE:${PN} = "pgs-serve.service"
SYSTEMD_AUTO_ENABLE = "disable"
USERADD_PACKAGES = "${PN}"
GROUPADD_PARAM:${PN} = "--system pgs"

do_compile() {
    oe_cargo_build -p pgs -p zynq-pgs-c
    for overlay in ${S}/device-tree/*.dtso; do
        dtc -q -@ -I dts -O dtb -o ${B}/$(basename $overlay .dtso).dtbo $overlay
    done
}

do_install() {
    built=${B}/target/${CARGO_TARGET_SUBDIR}
    install -D -m 0755 $built/pgs ${D}${bindir}/pgs
    install -D -m 0755 $built/libzynq_pgs_c.so ${D}${libdir}/libzynq_pgs_c.so.${ZPGS_ABI}
    ln -s libzynq_pgs_c.so.${ZPGS_ABI} ${D}${libdir}/libzynq_pgs_c.so
    install -D -m 0644 $built/libzynq_pgs_c.a ${D}${libdir}/libzynq_pgs_c.a
    install -D -m 0644 ${S}/tools/capi/include/zynq_pgs.h ${D}${includedir}/zynq_pgs.h
    install -d ${D}${libdir}/pkgconfig
    sed -e 's|@prefix@|${prefix}|' -e 's|@version@|${PV}|' -e 's|^libdir=.*|libdir=${libdir}|' \
        ${S}/tools/capi/zynq-pgs.pc.in > ${D}${libdir}/pkgconfig/zynq-pgs.pc
    for overlay in ${B}/*.dtbo; do
        install -D -m 0644 $overlay ${D}${datadir}/zynq-pgs/overlays/$(basename $overlay)
    done
    for source in ${S}/device-tree/*.dts?; do
        install -D -m 0644 $source ${D}${datadir}/zynq-pgs/device-tree/$(basename $source)
    done
    install -D -m 0644 ${S}/device-tree/99-zynq-pgs.rules ${D}${nonarch_base_libdir}/udev/rules.d/99-zynq-pgs.rules
    install -D -m 0644 ${S}/tools/packages/systemd/pgs-serve.service ${D}${systemd_system_unitdir}/pgs-serve.service
    install -D -m 0644 ${S}/tools/packages/systemd/pgs-serve.default ${D}${sysconfdir}/default/pgs-serve
}

FILES:${PN} += "${systemd_system_unitdir} ${nonarch_base_libdir}/udev"
CONFFILES:${PN} = "${sysconfdir}/default/pgs-serve"
COMPATIBLE_HOST = "(aarch64|x86_64).*-linux"
