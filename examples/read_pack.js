// Read the reference pack: node read_pack.js pack.json NAME
const { readFileSync } = require("fs");
const [path, name] = process.argv.slice(2);
const pack = JSON.parse(readFileSync(path, "utf8"));
if (!pack.version.startsWith("1.")) throw new Error(`unknown version ${pack.version}`);
const motion = pack.motions.find((each) => each.name === name);
if (!motion) throw new Error(`no motion ${name}`);
const doubles = (balls) => balls.map((ball) => Number(ball.value));
motion.times.forEach((time, i) => {
  const [numerator, denominator = "1"] = time.split("/");
  console.log(Number(numerator) / Number(denominator), ...doubles(motion.quaternion[i]), ...doubles(motion.position[i]));
});
