#!/bin/sh
# deb.sh BUILD VERSION: packs what `make install DESTDIR=BUILD/deb/root PREFIX=/usr` has put there, with the unit of
# systemd and its configuration, as BUILD/uzawa_VERSION_ARCHITECTURE.deb. What the programs need is read from them.
set -eu
build=$1 version=$2
root=$build/deb/root
architecture=$(dpkg --print-architecture)
install -d "$root/lib/systemd/system" "$root/DEBIAN" "$build/deb/debian"
sed 's,/usr/local/bin,/usr/bin,' server/uzawad.service >"$root/lib/systemd/system/uzawad.service"
install -D -m 644 server/uzawad.conf.example "$root/etc/uzawad/uzawad.conf"
install -D -m 644 LICENSE "$root/usr/share/doc/uzawa/copyright"
gzip -9nf "$root/usr/share/man/man1/uzawa.1"
strip --strip-unneeded "$root/usr/bin/uzawad" "$root/usr/bin/uzawa"
: >"$build/deb/debian/control" # dpkg-shlibdeps wants one
depends=$(cd "$build/deb" && dpkg-shlibdeps -O root/usr/bin/uzawad root/usr/bin/uzawa | sed -n 's/^shlibs:Depends=//p')
cat >"$root/DEBIAN/control" <<END
Package: uzawa
Version: $version
Architecture: $architecture
Maintainer: $(git log -1 --format='%an <%ae>' 2>/dev/null || echo nobody)
Installed-Size: $(du -sk --exclude=DEBIAN "$root" | cut -f1)
Depends: $depends
Suggests: gmsh, librsvg2-bin
Section: science
Priority: optional
Description: contact solver service
 An HTTP daemon that solves contact problems of elastic bodies and certifies
 the answers, and its command line client. The service is started by
 systemctl enable --now uzawad, with /etc/uzawad/uzawad.conf.
END
echo /etc/uzawad/uzawad.conf >"$root/DEBIAN/conffiles"
dpkg-deb --build --root-owner-group -Zxz "$root" "$build/uzawa_${version}_$architecture.deb" >/dev/null
echo "$build/uzawa_${version}_$architecture.deb"
