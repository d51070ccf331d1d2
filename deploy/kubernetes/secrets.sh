#!/bin/bash
# Makes a CA with the certificates of master, workers and a client, and prints the secrets of the first two.
#
# usage: deploy/kubernetes/secrets.sh LAB | kubectl apply -f -
#        LAB is the folder of the CA, made if it is not there; LAB/me is for the client, on your machine
#
# environment: BOLIDE  the executable [default: bolide]
set -eu
lab=${1:?usage: secrets.sh LAB}
bolide=${BOLIDE:-bolide}
[ -e "$lab/ca.pem" ] || "$bolide" certs ca "$lab" >&2
host() { [ -d "$lab/$1" ] || "$bolide" certs host "$lab" "$@" >&2; }
host master --role master --address bolide-master --address bolide-master.bolide.svc --address bolide-master.bolide.svc.cluster.local
host worker --role worker
host me --role client
for name in master worker; do
    cat <<END
---
apiVersion: v1
kind: Secret
metadata:
  name: bolide-$name
  namespace: bolide
type: Opaque
data:
END
    for file in ca.pem host.pem host-key.pem; do
        echo "  $file: $(base64 -w 0 "$lab/$name/$file")"
    done
done
