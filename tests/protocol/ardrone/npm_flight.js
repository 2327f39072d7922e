// A flight of the npm client `ar-drone` as its users write it; tells what happened, one word a line.
const [at, navdata, video] = process.argv.slice(2).map(Number);
const ardrone = require('ar-drone');
const PaVEParser = require('ar-drone/lib/video/PaVEParser');
const ip = '127.0.0.1';

const client = new ardrone.Client({
  ip, port: video,
  udpControl: new ardrone.UdpControl({ip, port: at}),
  udpNavdataStream: new ardrone.UdpNavdataStream({ip, port: navdata}),
});
let newest = {}, frames = 0, over = false;
const tell = (word, value) => console.log(word + (value === undefined ? '' : ' ' + value));
const when = (condition, then) => setTimeout(() => condition() ? then() : when(condition, then), 30);

client.on('navdata', data => { if (data.demo) newest = data.demo; });
for (const name of ['takeoff', 'hovering', 'flying', 'landing', 'landed'])
  client.on(name, () => tell(name));
const parser = new PaVEParser();
parser.on('data', frame => {
  if (frames++ === 0) tell('first-frame', frame.frame_type);
  if (frame.frame_type === 1 && frame.payload.slice(4, 5)[0] === 0x67) tell('idr');
});
client.getVideoStream().on('data', data => { if (!over) parser.write(data); });

client.resume();
client.config('video:video_channel', 1, error => tell('config', error || 'acknowledged'));
client.takeoff(() => {
  tell('battery', client.battery());
  const start = newest.altitudeMeters;
  client.front(0.3);
  when(() => newest.xVelocity > 400 && newest.frontBackDegrees < -2, () => {
    tell('forward');
    client.stop(); client.clockwise(0.5);
    when(() => newest.clockwiseDegrees > 45, () => {
      tell('turned');
      client.stop(); client.up(0.5);
      when(() => newest.altitudeMeters > start + 0.3, () => {
        tell('higher');
        client.stop();
        client.once('hovering', () => client.land(() => { over = true; tell('frames', frames > 100); process.exit(0); }));
      });
    });
  });
});
